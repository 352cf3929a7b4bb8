#include "drivers/kit/simulation/quantity.h"

#include <algorithm>
#include <charconv>
#include <sstream>

#include "core/base/spelling.h"

namespace axlecast {

Result<double> ParseNumber(std::string_view text, double min, double max, std::string_view unit) {
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data(), end, value);
  // The comparison refuses NaN too.
  if (error == std::errc() && stopped == end && value >= min && value <= max) return value;
  std::string why = Quoted(text) + " is not a number from " + NumberText(min) + " to " + NumberText(max);
  if (!unit.empty()) why.append(" ").append(unit);
  return Failure(std::move(why));
}

Result<std::int64_t> ParseWholeNumber(std::string_view text, double min, double max, std::string_view unit) {
  const Result<double> number = ParseNumber(text, min, max, unit);
  if (!number) return Failure(number.error());
  if (*number != std::floor(*number)) return Failure(Quoted(text) + " is not a whole number");
  return static_cast<std::int64_t>(*number);
}

Result<std::size_t> ParseChoice(std::string_view text, std::span<const std::string_view> words) {
  const auto found = std::find(words.begin(), words.end(), text);
  if (found != words.end()) return static_cast<std::size_t>(found - words.begin());
  std::string list;
  for (const std::string_view word : words) list += (list.empty() ? "" : ", ") + std::string(word);
  return Failure(Quoted(text) + " is not one of " + list);
}

std::string NumberText(double value) {
  std::ostringstream text;
  text.precision(12);
  text << value;
  return text.str();
}

// ---- scripts ----

namespace {

constexpr double kMaxSeconds = 1e6;

void Apply(SimulatedDevice& device, const Script::Assignments& quantities) {
  // Each value was checked when the file was read, so none is refused here.
  for (const auto& [name, value] : quantities) {
    [[maybe_unused]] const Result<> done = device.Set(name, value);
  }
}

Script::Assignments ReadQuantities(ConfigMap& map, std::span<const std::string_view> names,
                                   SimulatedDevice& trial) {
  Script::Assignments quantities;
  for (const std::string_view name : names) {
    if (!map.Has(name)) continue;
    std::string value = map.String(name, "");
    if (const Result<> tried = trial.Set(name, value); tried) {
      quantities.emplace_back(name, std::move(value));
    } else {
      map.Error(name, tried.error().text);
    }
  }
  if (map.Has("motion") && map.Has("speed_rpm")) map.Error("speed_rpm", "excludes motion: keep one of the two");
  return quantities;
}

std::vector<Script::Step> ReadSteps(ConfigMap& map, std::span<const std::string_view> names,
                                    SimulatedDevice& trial) {
  std::vector<Script::Step> steps;
  for (ConfigMap& entry : map.List("script")) {
    entry.Require("at_s", "the time of this step after the start, in seconds");
    Script::Step step;
    step.at = std::llround(entry.Number("at_s", 0, 0, kMaxSeconds, "s") * 1e9);
    if (!steps.empty() && step.at < steps.back().at) {
      entry.Error("at_s", "is earlier than the step before it: put the steps in the order of their times");
    }
    trial.Advance(step.at);
    step.quantities = ReadQuantities(entry, names, trial);
    entry.Done();
    steps.push_back(std::move(step));
  }
  return steps;
}

}  // namespace

Script::Script(Assignments initial, std::vector<Step> steps, MonoNs period)
    : initial_(std::move(initial)), steps_(std::move(steps)), period_(period) {}

void Script::Start(SimulatedDevice& device, MonoNs now) {
  device.Advance(now);
  Apply(device, initial_);
  round_ = now;
  next_ = 0;
}

MonoNs Script::NextDue() const { return next_ < steps_.size() ? round_ + steps_[next_].at : kNever; }

void Script::Run(SimulatedDevice& device, MonoNs now) {
  while (NextDue() <= now) {
    device.Advance(NextDue());
    Apply(device, steps_[next_].quantities);
    if (++next_ == steps_.size() && period_ != kNever) {
      next_ = 0;
      round_ += period_;
    }
  }
}

Script ReadScript(ConfigMap& map, std::span<const std::string_view> names, SimulatedDevice& trial) {
  Script::Assignments initial = ReadQuantities(map, names, trial);
  std::vector<Script::Step> steps = ReadSteps(map, names, trial);
  const double period_s = map.Number("script_period_s", 0, 0, kMaxSeconds, "s (0: once)");
  const MonoNs period = period_s > 0 ? std::llround(period_s * 1e9) : kNever;
  if (!steps.empty() && period <= steps.back().at) {
    map.Error("script_period_s", "must be later than the script's last step");
  }
  return {std::move(initial), std::move(steps), period};
}

}  // namespace axlecast
