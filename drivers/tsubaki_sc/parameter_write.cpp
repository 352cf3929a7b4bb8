#include "drivers/tsubaki_sc/parameter_write.h"

#include <axlecast/command_status_t.hpp>

#include "core/device/operation.h"
#include "drivers/tsubaki_sc/parameters.h"

namespace axlecast::tsubaki_sc {
namespace {

using Reason = command_status_t;

constexpr std::size_t kMaxChanges = 4;  // of an outcome

}  // namespace

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

// The next run of neighbours that differ, or the reading back when there is none.
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

// Those that change come first: four fit. Of a running order only what was before is known.
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
