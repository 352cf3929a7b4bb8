#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/device/simulator.h"
#include "drivers/kit/simulation/quantity.h"

// The half of a simulator that is the same for every family: names, scripts, Set and State.
namespace axlecast {

// A device whose quantities are the entries of `Derived::Table()`, a static function that returns a
// `const QuantityTable<Derived>&`. `Base` is SimulatedDevice or an abstract class derived from it.
template <typename Derived, typename Base = SimulatedDevice>
class TableDevice : public Base {
 public:
  using Base::Base;
  [[nodiscard]] Result<> Set(std::string_view name, std::string_view value) final {
    std::string names;
    for (const auto& quantity : Derived::Table()) {
      if (quantity.name == name) return quantity.set(static_cast<Derived&>(*this), value);
      names += (names.empty() ? "" : ", ") + std::string(quantity.name);
    }
    return Failure("cannot be set while it runs: one of " + names);
  }
  // The names that Set accepts, in the order in which a configuration applies them.
  [[nodiscard]] static std::vector<std::string_view> QuantityNames() {
    std::vector<std::string_view> names;
    for (const auto& quantity : Derived::Table()) names.push_back(quantity.name);
    return names;
  }

 protected:
  // Returns the name and the present value of each quantity that is shown.
  [[nodiscard]] QuantityList ShownQuantities() const {
    QuantityList list;
    for (const auto& quantity : Derived::Table()) {
      if (quantity.show) list.emplace_back(quantity.name, quantity.show(static_cast<const Derived&>(*this)));
    }
    return list;
  }
};

// A device with its name and its script. A family with more data for each device derives its own struct.
template <typename Device>
struct ScriptedDevice {
  std::string name;
  Device device;
  Script script;
  bool started = false;

  // Starts the script at the first call, executes every step that is due, and advances the device to `now`.
  void CatchUp(MonoNs now) {
    if (!started) script.Start(device, now);
    started = true;
    script.Run(device, now);
    device.Advance(now);
  }
  [[nodiscard]] MonoNs NextDue() const { return started ? script.NextDue() : 0; }
};

// Reads the script of `device` and checks that `map` has no unknown key. Errors go into the map's list.
template <typename Device>
[[nodiscard]] Script ReadScriptOf(ConfigMap& map, const Device& device) {
  Device trial = device;
  Script script = ReadScript(map, Device::QuantityNames(), trial);
  map.Done();
  return script;
}

// Returns the unit with this name, or null. `units` is a container of structs with a member `name`.
template <typename Units>
[[nodiscard]] auto FindUnit(Units& units, std::string_view name) -> decltype(&*units.begin()) {
  const auto found = std::find_if(units.begin(), units.end(), [&](const auto& unit) { return unit.name == name; });
  return found == units.end() ? nullptr : &*found;
}

// A simulator of one or more units. `Unit` is a ScriptedDevice or a struct derived from it. Its device has a function
// `QuantityList Quantities() const`: every quantity with its value, then what the device measures.
template <typename Unit>
class UnitSimulator : public Simulator {
 public:
  [[nodiscard]] Result<> Set(std::string_view device, std::string_view key, std::string_view value,
                             MonoNs now) override {
    CatchUp(now);
    Unit* unit = FindUnit(units_, device);
    if (unit == nullptr) {
      std::string names;
      for (const Unit& known : units_) names += (names.empty() ? "" : ", ") + known.name;
      return Failure("no simulated device '" + std::string(device) + "' here: there is " + names);
    }
    const Result<> done = unit->device.Set(key, value);
    if (!done) return Failure(unit->name + '.' + std::string(key) + ": " + done.error().text);
    return {};
  }
  [[nodiscard]] QuantityList State(std::string_view device, MonoNs now) const override {
    const Unit* unit = FindUnit(units_, device);
    if (unit == nullptr) return {};
    auto copy = unit->device;  // State changes neither the time nor the random numbers of the device
    copy.Advance(now);
    QuantityList list = copy.Quantities();
    for (const auto& [name, count] : CountersOf(*unit)) list.emplace_back(name, std::to_string(count));
    return list;
  }
  [[nodiscard]] MonoNs NextDue() const override {
    MonoNs due = kNever;
    for (const Unit& unit : units_) due = std::min(due, unit.NextDue());
    return due;
  }

 protected:
  using CounterList = std::vector<std::pair<std::string, std::int64_t>>;

  explicit UnitSimulator(std::vector<Unit> units) : units_(std::move(units)) {}

  // Executes the scripts up to `now`.
  virtual void CatchUp(MonoNs now) {
    for (Unit& unit : units_) unit.CatchUp(now);
  }
  // What State shows after the quantities: traffic and rule violations since the start.
  [[nodiscard]] virtual CounterList CountersOf(const Unit& unit) const = 0;

  [[nodiscard]] std::vector<Unit>& units() { return units_; }
  [[nodiscard]] const std::vector<Unit>& units() const { return units_; }

 private:
  std::vector<Unit> units_;
};

}  // namespace axlecast
