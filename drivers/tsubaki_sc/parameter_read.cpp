#include "drivers/tsubaki_sc/parameter_read.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>

#include "core/device/operation.h"
#include "drivers/kit/read_back.h"
#include "drivers/tsubaki_sc/parameters.h"

namespace axlecast::tsubaki_sc {
namespace {

constexpr std::size_t kMaxChanges = 4;  // of an outcome

std::vector<Block> Wanted(const std::vector<ParameterValue>& parameters) {
  if (parameters.empty()) return {kParameterBlocks.begin(), kParameterBlocks.end()};
  return BlocksOf(parameters);
}

}  // namespace

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

}  // namespace axlecast::tsubaki_sc
