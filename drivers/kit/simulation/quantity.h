#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/base/result.h"
#include "core/base/time.h"
#include "core/config/config_map.h"

namespace axlecast {

// ---- texts of quantities, in the machine's file and at run time alike ----

// Parses a number from `min` to `max`. The error states the range and `unit`.
[[nodiscard]] Result<double> ParseNumber(std::string_view text, double min, double max, std::string_view unit);
// Parses a number without a fraction from `min` to `max`.
[[nodiscard]] Result<std::int64_t> ParseWholeNumber(std::string_view text, double min, double max,
                                                    std::string_view unit);
// Returns the index of `text` in `words`, or an error that lists the words.
[[nodiscard]] Result<std::size_t> ParseChoice(std::string_view text, std::span<const std::string_view> words);
// Returns the value with up to 12 digits.
[[nodiscard]] std::string NumberText(double value);

// ---- tables of quantities ----

// Names and values, in the order in which they are shown.
using QuantityList = std::vector<std::pair<std::string, std::string>>;

// A property of a simulated device that is set and shown by name.
template <typename Simulated>
struct SimulatedQuantity {
  std::string_view name;
  std::function<Result<>(Simulated& device, std::string_view value)> set;
  std::function<std::string(const Simulated& device)> show;  // null: never shown, or an event
};

// All quantities of a device, in the order in which a configuration applies them.
template <typename Simulated>
using QuantityTable = std::vector<SimulatedQuantity<Simulated>>;

// In the functions below, `member` is a pointer to a data member, or a generic lambda that returns a reference to the
// value: `[](auto& encoder) -> auto& { return encoder.line.delay_ns; }`.

// A number from `min` to `max`.
template <typename Simulated, typename Member>
[[nodiscard]] SimulatedQuantity<Simulated> NumberQuantity(std::string_view name, Member member, double min,
                                                          double max, std::string_view unit) {
  return {name,
          [=](Simulated& device, std::string_view value) -> Result<> {
            const Result<double> number = ParseNumber(value, min, max, unit);
            if (!number) return Failure(number.error());
            std::invoke(member, device) = *number;
            return {};
          },
          [=](const Simulated& device) { return NumberText(std::invoke(member, device)); }};
}

// A whole number from `min` to `max`. An integer member refuses a fraction; a double drops it.
template <typename Simulated, typename Member>
[[nodiscard]] SimulatedQuantity<Simulated> WholeQuantity(std::string_view name, Member member, double min,
                                                         double max, std::string_view unit) {
  using Value = std::remove_cvref_t<std::invoke_result_t<Member, Simulated&>>;
  return {name,
          [=](Simulated& device, std::string_view value) -> Result<> {
            if constexpr (std::is_floating_point_v<Value>) {
              const Result<double> number = ParseNumber(value, min, max, unit);
              if (!number) return Failure(number.error());
              std::invoke(member, device) = std::floor(*number);
            } else {
              const Result<std::int64_t> number = ParseWholeNumber(value, min, max, unit);
              if (!number) return Failure(number.error());
              std::invoke(member, device) = static_cast<Value>(*number);
            }
            return {};
          },
          [=](const Simulated& device) { return NumberText(static_cast<double>(std::invoke(member, device))); }};
}

// One of `words`. The member is a bool or an enum whose values are the indices of the words.
template <typename Simulated, typename Member>
[[nodiscard]] SimulatedQuantity<Simulated> ChoiceQuantity(std::string_view name, Member member,
                                                          std::initializer_list<std::string_view> words) {
  using Value = std::remove_cvref_t<std::invoke_result_t<Member, Simulated&>>;
  const std::vector<std::string_view> list(words);
  return {name,
          [=](Simulated& device, std::string_view value) -> Result<> {
            const Result<std::size_t> index = ParseChoice(value, list);
            if (!index) return Failure(index.error());
            std::invoke(member, device) = static_cast<Value>(*index);
            return {};
          },
          [=](const Simulated& device) {
            return std::string(list.at(static_cast<std::size_t>(std::invoke(member, device))));
          }};
}

// ---- devices and scripts ----

// One device of a simulator, as the machine's file, a script or an operator sets it.
class SimulatedDevice {
 public:
  virtual ~SimulatedDevice() = default;

  // Moves the device's time to `now`. What is set afterwards happens at this time.
  virtual void Advance(MonoNs now) = 0;
  // Sets one quantity. The error states what would be right.
  [[nodiscard]] virtual Result<> Set(std::string_view name, std::string_view value) = 0;
};

// Quantities of a simulated device that are set at given times after the start, once or periodically.
class Script {
 public:
  using Assignments = std::vector<std::pair<std::string, std::string>>;  // name, value
  struct Step {
    MonoNs at = 0;  // after the start
    Assignments quantities;
  };

  Script() = default;
  // `initial` is set at the start. `steps` are in the order of their times. With a `period`, which must be longer than
  // the time of the last step, the steps are repeated after each period.
  Script(Assignments initial, std::vector<Step> steps, MonoNs period);

  void Start(SimulatedDevice& device, MonoNs now);
  [[nodiscard]] MonoNs NextDue() const;
  // Executes every step that is due. The device is advanced to the time of each step before the step.
  void Run(SimulatedDevice& device, MonoNs now);

 private:
  Assignments initial_;
  std::vector<Step> steps_;
  MonoNs period_ = kNever;
  MonoNs round_ = 0;  // start of the present period
  std::size_t next_ = 0;
};

// Reads a device's quantities (`names`, applied in that order) and its keys `script` and `script_period_s`
// (docs/simulation.md). Sets each value on `trial`, a copy of the device, to check it. Errors go into the map's list.
[[nodiscard]] Script ReadScript(ConfigMap& map, std::span<const std::string_view> names, SimulatedDevice& trial);

}  // namespace axlecast
