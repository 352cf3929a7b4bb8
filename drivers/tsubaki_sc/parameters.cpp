#include "drivers/tsubaki_sc/parameters.h"

#include <algorithm>
#include <array>
#include <deque>
#include <string>
#include <vector>

namespace axlecast::tsubaki_sc {
namespace {

constexpr int kSets = 4;  // of the DIP switches

struct Table {
  std::deque<std::string> names;  // and helps: keep the views alive
  std::vector<ParameterSpec> specs;

  std::string_view Keep(std::string text) { return names.emplace_back(std::move(text)); }
  void Add(std::string name, std::string_view unit, int decimals, std::int32_t min, std::int32_t max, bool zero,
           std::string help) {
    const auto address = static_cast<std::uint16_t>(specs.size());
    specs.push_back({.name = Keep(std::move(name)),
                     .address = address,
                     .unit = unit,
                     .decimals = decimals,
                     .min = min,
                     .max = max,
                     .zero_disables = zero,
                     .help = Keep(std::move(help))});
  }
};

// "upper limit A" of upper_a.
std::string Words(const std::string& limit) {
  return limit.substr(0, limit.size() - 2) + " limit " + (limit.ends_with('a') ? "A" : "B");
}

// Guideline 11: 13 registers for each DIP switch setting, then the three that hold for all.
Table MakeTable() {
  Table table;
  for (int set = 1; set <= kSets; ++set) {
    const std::string number = std::to_string(set);
    for (const char* limit : {"upper_a", "upper_b", "lower_a", "lower_b"}) {
      for (const char* mains : {"50", "60"}) {
        table.Add(std::string("power_") + limit + "_" + number + "_" + mains + "hz", "W", 1, 0, 10'000, true,
                  "trip at this power, " + Words(limit) + ", mains of " + mains + " Hz, DIP switch setting " +
                      number + "; 0: no trip");
      }
    }
    table.Add("start_time_" + number, "s", 1, 1, 50, false,
              "no trip for this time after the start, DIP switch setting " + number);
    for (const char* limit : {"upper_a", "upper_b", "lower_a", "lower_b"}) {
      table.Add(std::string("shock_time_") + limit + "_" + number, "s", 1, 0, 300, false,
                "trip after this time beyond " + Words(limit) + ", DIP switch setting " + number);
    }
  }
  table.Add("overheat_limit", "degC", 1, 0, 1'250, true, "temperature at which it trips; 0: no trip");
  table.Add("excessive_shock_limit", "m/s2", 2, 0, 15'000, true, "acceleration at which it trips; 0: no trip");
  table.Add("log_interval", "s", 1, 1, 100, false, "time between two samples of a trip log");
  return table;
}

const Table& Known() {
  static const Table kTable = MakeTable();
  return kTable;
}

}  // namespace

std::span<const ParameterSpec> Parameters() { return Known().specs; }

const ParameterSpec* FindParameter(std::string_view name) {
  const auto& specs = Known().specs;
  const auto found = std::find_if(specs.begin(), specs.end(), [&](const auto& spec) { return spec.name == name; });
  return found == specs.end() ? nullptr : &*found;
}

}  // namespace axlecast::tsubaki_sc
