#include "drivers/tsubaki_sc/parameters.h"

#include <algorithm>
#include <array>
#include <axlecast/command_status_t.hpp>
#include <deque>
#include <string>
#include <vector>

#include "core/device/operation.h"
#include "drivers/kit/read_back.h"

namespace axlecast::tsubaki_sc {
namespace {

using Reason = command_status_t;

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

const Block& BlockOfParameter(const ParameterSpec& parameter) {
  return *std::find_if(kParameterBlocks.begin(), kParameterBlocks.end(),
                       [&](const Block& block) { return parameter.address < block.first + block.count; });
}

constexpr std::size_t kMaxChanges = 4;  // of an outcome

std::vector<Block> Wanted(const std::vector<ParameterValue>& parameters) {
  if (parameters.empty()) return {kParameterBlocks.begin(), kParameterBlocks.end()};
  return BlocksOf(parameters);
}

}  // namespace

std::span<const ParameterSpec> Parameters() { return Known().specs; }

const ParameterSpec* FindParameter(std::string_view name) {
  const auto& specs = Known().specs;
  const auto found = std::find_if(specs.begin(), specs.end(), [&](const auto& spec) { return spec.name == name; });
  return found == specs.end() ? nullptr : &*found;
}

std::vector<Block> BlocksOf(const std::vector<ParameterValue>& parameters) {
  std::vector<Block> blocks;
  for (const Block& block : kParameterBlocks) {
    const bool used = std::any_of(parameters.begin(), parameters.end(), [&](const ParameterValue& value) {
      return BlockOfParameter(*value.parameter) == block;
    });
    if (used) blocks.push_back(block);
  }
  return blocks;
}

std::uint16_t ValueIn(const BlockReader& read, const ParameterSpec& parameter) {
  const Block& block = BlockOfParameter(parameter);
  return read.Register(block, std::size_t{parameter.address} - block.first);
}

ParameterRead::ParameterRead(const Requests& requests, std::vector<ParameterValue> parameters, bool expected)
    : parameters_(std::move(parameters)), expected_(expected), reader_(requests, Wanted(parameters_)) {}

std::optional<Outcome> ParameterRead::OnAnswer(const Answer& answer) {
  switch (reader_.OnAnswer(answer)) {
    case BlockReader::Progress::kGoing:
      return std::nullopt;
    case BlockReader::Progress::kFailed:
      return GiveUp(reader_.reason(), reader_.cause());
    default:
      return parameters_.empty() ? ShowAll() : ShowSome();
  }
}

// 4 hex digits a register, so that 55 fit.
Outcome ParameterRead::ShowAll() const {
  Outcome outcome = Verified("all 55 parameters, 4 hex digits each, in the order of their registers");
  for (const Block& block : kParameterBlocks) {
    std::string digits;
    for (std::size_t i = 0; i < block.count; ++i) digits += Text("%04X", unsigned{reader_.Register(block, i)});
    outcome.changes.push_back({Text("registers %d-%d", block.first, block.first + block.count - 1), "", digits});
  }
  return outcome;
}

Outcome ParameterRead::ShowSome() const {
  std::string text;
  bool equal = true;
  Outcome outcome;
  for (const ParameterValue& wanted : parameters_) {
    const std::uint16_t value = ValueIn(reader_, *wanted.parameter);
    const std::string shown = ParameterText(*wanted.parameter, value);
    equal = equal && value == wanted.value;
    text += (text.empty() ? "" : ", ") + std::string(wanted.parameter->name) + " " + shown + " " +
            std::string(wanted.parameter->unit);
    outcome.changes.push_back({std::string(wanted.parameter->name), "", shown});
  }
  std::vector<Change> changes = std::move(outcome.changes);
  outcome = Verified(Text("%s", text.c_str()));
  outcome.changes = std::move(changes);
  const std::size_t maximum = expected_ ? kMaxChanges - 1 : kMaxChanges;
  if (outcome.changes.size() > maximum) outcome.changes.resize(maximum);
  if (expected_) outcome.changes.push_back(FindingChange(FindingWord(equal)));
  return outcome;
}

Outcome ParameterRead::GiveUp(std::int32_t reason, const std::string& cause) const {
  return Final(CommandState::kFailed, reason, "the parameters could not be read: " + cause);
}

ParameterWrite::ParameterWrite(const Requests& requests, std::vector<ParameterValue> values, DeviceOutput& output)
    : requests_(requests), values_(std::move(values)), output_(output), reader_(requests, BlocksOf(values_)) {}

Exchange ParameterWrite::Next() const {
  if (stage_ != Stage::kWrite) return reader_.Next();
  return requests_.Write(values_[run_].parameter->address, registers_);
}

std::optional<Outcome> ParameterWrite::OnAnswer(const Answer& answer) {
  return stage_ == Stage::kWrite ? OnWritten(answer) : OnRead(answer);
}

std::optional<Outcome> ParameterWrite::OnRead(const Answer& answer) {
  switch (reader_.OnAnswer(answer)) {
    case BlockReader::Progress::kGoing:
      return std::nullopt;
    case BlockReader::Progress::kFailed:
      return GiveUp(reader_.reason(), reader_.cause());
    default:
      break;
  }
  if (stage_ == Stage::kAfter) return Done();
  for (const ParameterValue& value : values_) before_.push_back(ValueIn(reader_, *value.parameter));
  if (auto done = NextRun(0)) return done;
  Outcome running;
  running.text = "the present values are read";
  return WithChanges(std::move(running), nullptr);
}

// Prepares the next run of neighbours that differ, or the read-back after the last run.
std::optional<Outcome> ParameterWrite::NextRun(std::size_t from) {
  run_ = from;
  while (run_ < values_.size() && !Differs(run_)) ++run_;
  if (run_ == values_.size()) {
    if (!sent_) {
      return WithChanges(Verified("nothing to write: the parameters have these values already"), &before_);
    }
    stage_ = Stage::kAfter;
    reader_.Restart();
    return std::nullopt;
  }
  registers_ = {values_[run_].value};
  run_end_ = run_ + 1;
  while (run_end_ < values_.size() && Differs(run_end_) &&
         values_[run_end_].parameter->address == values_[run_end_ - 1].parameter->address + 1) {
    registers_.push_back(values_[run_end_++].value);
  }
  stage_ = Stage::kWrite;
  return std::nullopt;
}

std::optional<Outcome> ParameterWrite::OnWritten(const Answer& answer) {
  if (answer.refused()) {
    refusal_ = CauseOf(answer);
    sent_ = written_ > 0;
    if (!sent_) {
      return Final(
          CommandState::kFailed, Reason::REASON_DEVICE_REFUSED,
          "nothing was written: the unit refused " + std::string(values_[run_].parameter->name) + ": " + refusal_);
    }
    return NextRun(values_.size());
  }
  // One whose reply was lost may have been done.
  output_.OnNonVolatileWrite();
  written_ += run_end_ - run_;
  return NextRun(run_end_);
}

Outcome ParameterWrite::Done() const {
  std::vector<std::uint16_t> after;
  std::string differing;
  for (const ParameterValue& wanted : values_) {
    after.push_back(ValueIn(reader_, *wanted.parameter));
    if (after.back() == wanted.value) continue;
    differing += " " + std::string(wanted.parameter->name) + " " + ParameterText(*wanted.parameter, after.back()) +
                 " instead of " + ParameterText(*wanted.parameter, wanted.value) + ";";
  }
  if (differing.empty()) {
    return WithChanges(Verified(Text("read back; %zu of %zu parameters were written, the others had their value",
                                     written_, values_.size())),
                       &after);
  }
  std::int32_t reason = Reason::REASON_READ_BACK_DIFFERS;
  if (!refusal_.empty()) reason = Reason::REASON_DEVICE_REFUSED;
  const std::string why = refusal_.empty() ? "it reads" : "the unit refused a write (" + refusal_ + "); it reads";
  return WithChanges(Final(CommandState::kFailed, reason, Text("%s%s", why.c_str(), differing.c_str())), &after);
}

Outcome ParameterWrite::GiveUp(std::int32_t reason, const std::string& cause) const {
  if (!sent_) return Final(CommandState::kFailed, reason, Text("nothing was written: %s", cause.c_str()));
  return WithChanges(
      Final(CommandState::kIndeterminate, reason,
            Text("%zu parameters were written, but could not be read back: %s", written_, cause.c_str())),
      nullptr);
}

// Those that change come first: four fit. While the command runs, only the values before are known.
Outcome ParameterWrite::WithChanges(Outcome outcome, const std::vector<std::uint16_t>* after) const {
  for (const bool changed : {true, false}) {
    for (std::size_t i = 0; i < before_.size() && outcome.changes.size() < kMaxChanges; ++i) {
      if (Differs(i) != changed) continue;
      const ParameterSpec& parameter = *values_[i].parameter;
      outcome.changes.push_back({std::string(parameter.name), ParameterText(parameter, before_[i]),
                                 after == nullptr ? "" : ParameterText(parameter, (*after)[i])});
    }
  }
  return outcome;
}

}  // namespace axlecast::tsubaki_sc
