#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <deque>
#include <string>
#include <vector>

#include "core/base/text.h"
#include "drivers/kit/arguments.h"
#include "drivers/kit/command_runner.h"
#include "drivers/tsubaki_sc/operations.h"
#include "drivers/tsubaki_sc/readout.h"

namespace axlecast::tsubaki_sc {
namespace {

using Reason = command_status_t;

constexpr std::string_view kReadParametersName = "read_parameters";
constexpr std::string_view kWriteParameterName = "write_parameter";
constexpr std::string_view kWriteParametersName = "write_parameters";

// ---- the table ----

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

// Guideline 11: 13 registers for each of the four DIP switch settings, then the three that hold for all.
Table MakeTable() {
  Table table;
  for (const std::string set : {"1", "2", "3", "4"}) {
    for (const char* limit : {"upper_a", "upper_b", "lower_a", "lower_b"}) {
      for (const char* mains : {"50", "60"}) {
        table.Add(std::string("power_") + limit + "_" + set + "_" + mains + "hz", "W", 1, 0, 10'000, true,
                  "trip at this power, " + Words(limit) + ", mains of " + mains + " Hz, DIP switch setting " + set +
                      "; 0: no trip");
      }
    }
    table.Add("start_time_" + set, "s", 1, 1, 50, false,
              "no trip for this time after the start, DIP switch setting " + set);
    for (const char* limit : {"upper_a", "upper_b", "lower_a", "lower_b"}) {
      table.Add(std::string("shock_time_") + limit + "_" + set, "s", 1, 0, 300, false,
                "trip after this time beyond " + Words(limit) + ", DIP switch setting " + set);
    }
  }
  table.Add("overheat_limit", "degC", 1, 0, 1'250, true, "temperature at which it trips; 0: no trip");
  table.Add("excessive_shock_limit", "m/s2", 2, 0, 15'000, true, "acceleration at which it trips; 0: no trip");
  table.Add("log_interval", "s", 1, 1, 100, false, "time between two samples of a trip log");
  return table;
}

// ---- the registers of some parameters ----

// A parameter and its value, or the value that it shall have.
struct ParameterValue {
  const ParameterSpec* parameter = nullptr;
  std::uint16_t value = 0;

  [[nodiscard]] std::string name() const { return std::string(parameter->name); }
  [[nodiscard]] std::uint16_t address() const { return parameter->address; }
  [[nodiscard]] std::string Shown(std::uint16_t other) const { return ParameterText(*parameter, other); }
};
using Values = std::vector<ParameterValue>;

const Block& BlockOfParameter(std::uint16_t address) {
  return *std::find_if(kParameterBlocks.begin(), kParameterBlocks.end(),
                       [&](const Block& block) { return address < block.first + block.count; });
}

// Returns the blocks of kParameterBlocks that hold these parameters, in order. None: all of them.
std::vector<Block> BlocksOf(const Values& values) {
  std::vector<Block> blocks;
  for (const Block& block : kParameterBlocks) {
    const auto in_block = [&](const ParameterValue& value) { return BlockOfParameter(value.address()) == block; };
    if (values.empty() || std::any_of(values.begin(), values.end(), in_block)) blocks.push_back(block);
  }
  return blocks;
}

std::uint16_t ValueIn(const BlockReader& read, const ParameterValue& value) {
  const Block& block = BlockOfParameter(value.address());
  return read.Register(block, std::size_t{value.address()} - block.first);
}

// read_parameter and read_parameters: some parameters with their values, or all 55 registers.
class ParameterRead final : public Procedure {
 public:
  // No parameters: all of them. With `expected`, the change `finding` shows whether they have these values.
  ParameterRead(const Requests& requests, Values values, bool expected)
      : values_(std::move(values)), expected_(expected), reader_(requests, BlocksOf(values_)) {}

  [[nodiscard]] Exchange Next() const override { return reader_.Next(); }
  std::optional<Outcome> OnAnswer(const Answer& answer) override {
    const Result<bool> done = reader_.OnAnswer(answer);
    if (!done) return GiveUp(done.error());
    if (!*done) return std::nullopt;
    return values_.empty() ? ShowAll() : ShowSome();
  }
  [[nodiscard]] Outcome GiveUp(const Error& error) const override {
    return Final(CommandState::kFailed, error.reason, "the parameters could not be read: " + error.text);
  }

 private:
  // 4 hex digits a register, so that 55 fit.
  [[nodiscard]] Outcome ShowAll() const {
    Outcome outcome = Verified("all 55 parameters, 4 hex digits each, in the order of their registers");
    for (const Block& block : kParameterBlocks) {
      std::string digits;
      for (std::size_t i = 0; i < block.count; ++i) digits += Text("%04X", unsigned{reader_.Register(block, i)});
      outcome.changes.push_back({Text("registers %d-%d", block.first, block.first + block.count - 1), "", digits});
    }
    return outcome;
  }

  [[nodiscard]] Outcome ShowSome() const {
    std::string text;
    bool equal = true;
    std::vector<Change> changes;
    for (const ParameterValue& value : values_) {
      const std::uint16_t present = ValueIn(reader_, value);
      const std::string shown = value.Shown(present);
      equal = equal && present == value.value;
      text += (text.empty() ? "" : ", ") + value.name() + " " + shown + " " + std::string(value.parameter->unit);
      if (changes.size() < kMaxChanges - (expected_ ? 1 : 0)) changes.push_back({value.name(), "", shown});
    }
    if (expected_) changes.push_back(FindingChange(FindingWord(equal)));
    Outcome outcome = Verified(std::move(text));
    outcome.changes = std::move(changes);
    return outcome;
  }

  const Values values_;
  const bool expected_;
  BlockReader reader_;
};

// write_parameter and write_parameters: reads the parameters, writes those that differ, neighbours in one request,
// and reads all of them back. No write is repeated: the reading shows the result.
class ParameterWrite final : public Procedure {
 public:
  // In the order of their addresses, each once.
  ParameterWrite(const Requests& requests, Values values, DeviceOutput& output)
      : requests_(requests), values_(std::move(values)), output_(output), reader_(requests, BlocksOf(values_)) {}

  [[nodiscard]] Exchange Next() const override {
    return stage_ == Stage::kWrite ? requests_.Write(values_[run_].address(), registers_) : reader_.Next();
  }
  void OnStarted() override { sent_ = sent_ || stage_ == Stage::kWrite; }
  void OnLoggedOut() override { sent_ = written_ > 0; }
  std::optional<Outcome> OnAnswer(const Answer& answer) override {
    if (stage_ == Stage::kWrite) return OnWritten(answer);
    const Result<bool> done = reader_.OnAnswer(answer);
    if (!done) return GiveUp(done.error());
    if (!*done) return std::nullopt;
    if (stage_ == Stage::kAfter) return Done();
    for (const ParameterValue& value : values_) before_.push_back(ValueIn(reader_, value));
    if (auto outcome = NextRun(0)) return outcome;
    return WithChanges({.text = "the present values are read"}, nullptr);
  }
  [[nodiscard]] Outcome GiveUp(const Error& error) const override {
    if (!sent_) return Final(CommandState::kFailed, error.reason, "nothing was written: " + error.text);
    return WithChanges(
        Final(CommandState::kIndeterminate, error.reason,
              Text("%zu parameters were written, but could not be read back: ", written_) + error.text),
        nullptr);
  }
  [[nodiscard]] bool touched() const override { return sent_; }

 private:
  enum class Stage : std::uint8_t { kBefore, kWrite, kAfter };

  [[nodiscard]] bool Differs(std::size_t index) const { return before_[index] != values_[index].value; }

  // Prepares the next run of neighbours that differ, or the read-back after the last run.
  std::optional<Outcome> NextRun(std::size_t from) {
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
           values_[run_end_].address() == values_[run_end_ - 1].address() + 1) {
      registers_.push_back(values_[run_end_++].value);
    }
    stage_ = Stage::kWrite;
    return std::nullopt;
  }

  std::optional<Outcome> OnWritten(const Answer& answer) {
    if (answer.refused()) {
      refusal_ = CauseOf(answer);
      sent_ = written_ > 0;
      if (sent_) return NextRun(values_.size());
      return Final(CommandState::kFailed, Reason::REASON_DEVICE_REFUSED,
                   "nothing was written: the unit refused " + values_[run_].name() + ": " + refusal_);
    }
    // A write whose reply was lost may have been executed.
    output_.OnNonVolatileWrite();
    written_ += run_end_ - run_;
    return NextRun(run_end_);
  }

  [[nodiscard]] Outcome Done() const {
    std::vector<std::uint16_t> after;
    std::string differing;
    for (const ParameterValue& value : values_) {
      after.push_back(ValueIn(reader_, value));
      if (after.back() == value.value) continue;
      differing += (differing.empty() ? "" : ", ") + value.name() + " " + value.Shown(after.back()) +
                   " instead of " + value.Shown(value.value);
    }
    if (differing.empty()) {
      return WithChanges(Verified(Text("read back; %zu of %zu parameters were written, the others had their value",
                                       written_, values_.size())),
                         &after);
    }
    Error error = {"it reads " + differing, Reason::REASON_READ_BACK_DIFFERS};
    if (!refusal_.empty()) {
      error = {"the unit refused a write (" + refusal_ + "); " + error.text, Reason::REASON_DEVICE_REFUSED};
    }
    return WithChanges(Final(CommandState::kFailed, error.reason, error.text), &after);
  }

  // Those that change come first: four fit. While the command runs, only the values before are known.
  [[nodiscard]] Outcome WithChanges(Outcome outcome, const std::vector<std::uint16_t>* after) const {
    for (const bool changed : {true, false}) {
      for (std::size_t i = 0; i < before_.size() && outcome.changes.size() < kMaxChanges; ++i) {
        if (Differs(i) != changed) continue;
        outcome.changes.push_back({values_[i].name(), values_[i].Shown(before_[i]),
                                   after == nullptr ? "" : values_[i].Shown((*after)[i])});
      }
    }
    return outcome;
  }

  const Requests& requests_;
  const Values values_;
  DeviceOutput& output_;
  BlockReader reader_;
  Stage stage_ = Stage::kBefore;
  std::vector<std::uint16_t> before_;
  std::size_t run_ = 0;  // the values [run_, run_end_) are written together
  std::size_t run_end_ = 0;
  std::vector<std::uint16_t> registers_;  // of the run
  std::size_t written_ = 0;
  bool sent_ = false;
  std::string refusal_;  // of a write: the others are not sent
};

// ---- commands ----

// name=value pairs as parameters, in the order of their addresses.
Result<Values> ParseValues(const Arguments& arguments) {
  Values values;
  for (const auto& [name, text] : arguments) {
    const ParameterSpec* parameter = FindParameter(name);
    if (parameter == nullptr) return BadArgument("there is no parameter " + name.substr(0, 40));
    const Result<std::uint16_t> value = ParseParameter(*parameter, text);
    if (!value) return BadArgument(value.error().text);
    values.push_back({parameter, *value});
  }
  if (values.empty() || values.size() > kMaxArguments) return BadArgument("give 1 to 16 parameters as name=value");
  std::sort(values.begin(), values.end(),
            [](const ParameterValue& a, const ParameterValue& b) { return a.address() < b.address(); });
  const auto twice = std::adjacent_find(values.begin(), values.end(),
                                        [](const auto& a, const auto& b) { return a.parameter == b.parameter; });
  if (twice != values.end()) return BadArgument(twice->name() + " is given twice");
  return values;
}

// Returns the values that a write_parameter or write_parameters writes.
Result<Values> WrittenBy(std::string_view operation, const Arguments& arguments) {
  if (operation == kWriteParametersName) return ParseValues(arguments);
  if (operation != kWriteParameterName) return BadArgument("after must be a write_parameter or write_parameters");
  return ParseValues({{std::string(FindArgument(arguments, "name").value_or("")),
                       std::string(FindArgument(arguments, "value").value_or(""))}});
}

MadeProcedure MakeWrite(const DriverCommand& command, const OperationContext& context) {
  Result<Values> values = WrittenBy(command.operation, command.arguments);
  if (!values) return Failure(values.error());
  return std::make_unique<ParameterWrite>(context.requests, *std::move(values), context.output);
}

MadeProcedure MakeReadSome(std::string_view names, const OperationContext& context) {
  Values values;
  while (!names.empty()) {
    const std::size_t comma = std::min(names.find(','), names.size());
    const std::string_view name = names.substr(0, comma);
    const ParameterSpec* parameter = FindParameter(name);
    if (parameter == nullptr) {
      return BadArgument("there is no parameter " + std::string(name.substr(0, 40)) +
                         "; e.g. power_upper_a_1_50hz, start_time_1, log_interval");
    }
    values.push_back({parameter, 0});
    names.remove_prefix(std::min(comma + 1, names.size()));
  }
  if (values.empty() || values.size() > kMaxChanges) {
    return BadArgument("names must be one to four, separated by commas; leave it out for all");
  }
  return std::make_unique<ParameterRead>(context.requests, std::move(values), false);
}

MadeProcedure MakeReadOne(const DriverCommand& command, const OperationContext& context) {
  return MakeReadSome(FindArgument(command.arguments, "name").value_or(""), context);
}

MadeProcedure MakeRead(const DriverCommand& command, const OperationContext& context) {
  if (const auto after = AfterArgument(command.arguments)) {
    Result<Values> values = WrittenBy(after->operation, after->arguments);
    if (!values) return Failure(values.error());
    return std::make_unique<ParameterRead>(context.requests, *std::move(values), true);
  }
  const auto names = FindArgument(command.arguments, "names");
  if (!names) return std::make_unique<ParameterRead>(context.requests, Values(), false);
  return MakeReadSome(*names, context);
}

// read_set_values: the values that hold at the present DIP switch setting and mains frequency (AI 0-8).
Outcome ShowSetValues(const BlockReader& read) {
  const auto value = [&](std::size_t index) { return read.Register(kSetValues, index) / 10.0; };
  const auto four = [&](std::size_t first, const char* unit) {
    return Text("upper_a %.1f, upper_b %.1f, lower_a %.1f, lower_b %.1f %s", value(first), value(first + 1),
                value(first + 2), value(first + 3), unit);
  };
  Outcome outcome = Verified("what holds at the present DIP switch setting and mains frequency");
  outcome.changes = {
      {"power", "", four(0, "W")}, {"start_time", "", Text("%.1f s", value(4))}, {"shock_time", "", four(5, "s")}};
  return outcome;
}

MadeProcedure MakeReadSetValues(const DriverCommand&, const OperationContext& context) {
  return std::make_unique<Readout>(context.requests, std::vector{kSetValues}, ShowSetValues);
}

std::vector<ArgumentSpec> ParameterArguments() {
  std::vector<ArgumentSpec> arguments;
  for (const ParameterSpec& parameter : Parameters()) {
    arguments.push_back({parameter.name, parameter.help, false});
  }
  return arguments;
}

}  // namespace

std::span<const ParameterSpec> Parameters() {
  static const Table kTable = MakeTable();
  return kTable.specs;
}

const ParameterSpec* FindParameter(std::string_view name) {
  const auto specs = Parameters();
  const auto found = std::find_if(specs.begin(), specs.end(), [&](const auto& spec) { return spec.name == name; });
  return found == specs.end() ? nullptr : &*found;
}

std::vector<Operation> ParameterOperations() {
  return {
      {ReadOnly(
           {.name = "read_set_values",
            .help = "Reads the limits and times that hold at the present DIP switch setting and mains frequency"}),
       MakeReadSetValues},
      {ReadOnly({.name = "read_parameter",
                 .help = "Reads one parameter",
                 .arguments = {{"name", "e.g. power_upper_a_1_50hz; the family's README lists all 55"}}}),
       MakeReadOne},
      {ReadOnly({.name = kReadParametersName,
                 .help = "Reads up to four parameters, or all 55 as registers in hex",
                 .arguments = {{"names", "up to four, e.g. start_time_1,log_interval; leave it out for all", false},
                               kAfterArgument}}),
       MakeRead},
      {{.name = kWriteParameterName,
        .help = "Writes one parameter",
        .arguments = {{"name", "e.g. power_upper_a_1_50hz"}, {"value", "in its unit, e.g. 125.0"}},
        .destructive = true,
        .verification = "it is read back",
        .verified_by_operation = kReadParametersName},
       MakeWrite},
      {{.name = kWriteParametersName,
        .help =
            "Writes up to 16 parameters, each given as name=value in its unit; all are checked before any is sent",
        .arguments = ParameterArguments(),
        .destructive = true,
        .verification = "all are read back",
        .verified_by_operation = kReadParametersName},
       MakeWrite},
  };
}

}  // namespace axlecast::tsubaki_sc
