#include "drivers/tsubaki_sc/readout.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <cassert>

#include "core/device/operation.h"
#include "drivers/kit/read_back.h"
#include "drivers/tsubaki_sc/interpreter.h"
#include "drivers/tsubaki_sc/operations.h"

namespace axlecast::tsubaki_sc {
namespace {

constexpr std::size_t kTripCount = 0;  // registers of kStatus
constexpr std::size_t kMotorStatus = 1;

// What an operation leaves behind when it took effect: guideline 8.
const char* FindingAfter(const std::string& after, bool stopped, unsigned count) {
  if (after == kStopMotorName) return FindingWord(stopped);
  if (after == kStartMotorName) return FindingWord(!stopped);
  return FindingWord(count == 0);
}

}  // namespace

BlockReader::BlockReader(const Requests& requests, std::vector<Block> blocks) : requests_(&requests) {
  for (const Block& block : blocks) parts_.push_back({block, {}});
}

BlockReader::Progress BlockReader::OnAnswer(const Answer& answer) {
  if (!answer.ok()) {
    cause_ = CauseOf(answer);
    reason_ = ReasonOf(answer);
    return !answer.refused() && ++failures_ < kTries ? Progress::kGoing : Progress::kFailed;
  }
  failures_ = 0;
  parts_[done_].data = InlineBytes<kMaxBytes>(answer.reply.data);
  return ++done_ < parts_.size() ? Progress::kGoing : Progress::kDone;
}

void BlockReader::Restart() {
  done_ = 0;
  failures_ = 0;
}

Bytes BlockReader::Data(const Block& block) const {
  const auto found =
      std::find_if(parts_.begin(), parts_.end(), [&](const Part& part) { return part.block == block; });
  assert(found != parts_.end());
  return found->data;
}

std::uint16_t BlockReader::Register(const Block& block, std::size_t index) const {
  const Bytes data = Data(block);
  return static_cast<std::uint16_t>((data[2 * index] << 8) | data[2 * index + 1]);
}

std::optional<Outcome> Readout::OnAnswer(const Answer& answer) {
  switch (reader_.OnAnswer(answer)) {
    case BlockReader::Progress::kGoing:
      return std::nullopt;
    case BlockReader::Progress::kFailed:
      return GiveUp(reader_.reason(), reader_.cause());
    default:
      return show_(reader_, order_, after_);
  }
}

Outcome Readout::GiveUp(std::int32_t reason, const std::string& cause) const {
  return Final(CommandState::kFailed, reason, "it could not be read: " + cause);
}

std::vector<Block> StateBlocks() { return {kStatus, kStopCoil, kLoginStatus, kMains}; }

Outcome ShowState(const BlockReader& read, CharacterOrder, const std::string& after) {
  const unsigned count = read.Register(kStatus, kTripCount);
  const std::string motor = StatusText(read.Register(kStatus, kMotorStatus));
  const bool stopped = read.Bit(kStopCoil);
  const bool logged_in = read.Register(kLoginStatus, 0) == kSaysLoggedIn;
  Outcome outcome =
      Verified(Text("trip count %u, motor status %s, stop coil %d, %s, mains %d Hz", count, motor.c_str(),
                    stopped ? 1 : 0, logged_in ? "logged in" : "logged out", read.Bit(kMains) ? 60 : 50));
  outcome.changes.push_back({"trip_count", "", std::to_string(count)});
  outcome.changes.push_back({"motor_status", "", motor});
  outcome.changes.push_back({"stop_coil", "", stopped ? "1" : "0"});
  if (after.empty())
    outcome.changes.push_back({"logged_in", "", logged_in ? "1" : "0"});
  else
    outcome.changes.push_back(FindingChange(FindingAfter(after, stopped, count)));
  return outcome;
}

Outcome ShowSetValues(const BlockReader& read, CharacterOrder, const std::string&) {
  const auto value = [&](std::size_t index) { return read.Register(kSetValues, index) / 10.0; };
  const auto four = [&](std::size_t first, const char* unit) {
    return Text("upper_a %.1f, upper_b %.1f, lower_a %.1f, lower_b %.1f %s", value(first), value(first + 1),
                value(first + 2), value(first + 3), unit);
  };
  Outcome outcome = Verified("what holds at the present DIP switch setting and mains frequency");
  outcome.changes.push_back({"power", "", four(0, "W")});
  outcome.changes.push_back({"start_time", "", Text("%.1f s", value(4))});
  outcome.changes.push_back({"shock_time", "", four(5, "s")});
  return outcome;
}

std::vector<Block> IdentityBlocks() { return {kProductCode, kMfgNumber, kVersion}; }

Outcome ShowIdentity(const BlockReader& read, CharacterOrder order, const std::string&) {
  const std::string product = RegisterText(read.Data(kProductCode), order);
  const std::string serial = RegisterText(read.Data(kMfgNumber), order);
  const std::string version = VersionText(read.Data(kVersion));
  Outcome outcome = Verified("product code " + product + ", MFG number " + serial + ", version " + version);
  outcome.changes.push_back({"product_code", "", product});
  outcome.changes.push_back({"mfg_number", "", serial});
  outcome.changes.push_back({"version", "", version});
  return outcome;
}

}  // namespace axlecast::tsubaki_sc
