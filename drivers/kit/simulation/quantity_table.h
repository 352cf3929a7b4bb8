#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace axlecast {

// Something of a simulated device that is set and shown by name. A table holds them in the order in which a
// configuration applies them.
template <typename Simulated>
struct SimulatedQuantity {
  std::string_view name;
  std::string (*set)(Simulated& device, std::string_view value);  // empty, or why it cannot be set
  std::string (*show)(const Simulated& device);                   // null: never shown, or an event
};
template <typename Simulated>
using QuantityTable = std::vector<SimulatedQuantity<Simulated>>;

template <typename Simulated>
[[nodiscard]] std::vector<std::string_view> NamesOf(const QuantityTable<Simulated>& table) {
  std::vector<std::string_view> names;
  for (const auto& quantity : table) names.push_back(quantity.name);
  return names;
}

template <typename Simulated>
[[nodiscard]] std::string SetByName(const QuantityTable<Simulated>& table, Simulated& device, std::string_view name,
                                    std::string_view value) {
  std::string names;
  for (const auto& quantity : table) {
    if (quantity.name == name) return quantity.set(device, value);
    names += (names.empty() ? "" : ", ") + std::string(quantity.name);
  }
  return "cannot be set while it runs: one of " + names;
}

// Name and present value of each that is shown.
template <typename Simulated>
[[nodiscard]] std::vector<std::pair<std::string, std::string>> Shown(const QuantityTable<Simulated>& table,
                                                                     const Simulated& device) {
  std::vector<std::pair<std::string, std::string>> list;
  for (const auto& quantity : table) {
    if (quantity.show != nullptr) list.emplace_back(quantity.name, quantity.show(device));
  }
  return list;
}

}  // namespace axlecast
