#include "drivers/saa_can/cia406/readouts.h"

#include <array>
#include <axlecast/command_status_t.hpp>

#include "core/device/operation.h"
#include "drivers/kit/read_back.h"
#include "drivers/saa_can/cia406/objects.h"

namespace axlecast::saa_can::cia406 {
namespace {

using Reason = command_status_t;

constexpr std::array<ObjectId, 1> kPositionObjects = {kPosition};
constexpr std::array<ObjectId, 5> kIdentityObjects = {kDeviceType, kVendor, kProduct, kRevision, kSerial};
constexpr std::array<ObjectId, 4> kStateObjects = {kErrorRegister, kOperatingStatus, kAlarms, kWarnings};

std::string Hex(std::optional<std::uint32_t> value, int digits) {
  return value ? Text("0x%0*X", digits, *value) : "not offered";
}

}  // namespace

std::string PositionText(std::uint32_t position, const Cia406Settings& settings) {
  const std::uint32_t counts = position & ((std::uint32_t{1} << settings.bits) - 1);
  const double degrees = Degrees(counts, settings.bits);
  if (settings.turn_bits == 0) return Text("single-turn %u (%.4f deg)", counts, degrees);
  return Text("turns %u, single-turn %u (%.4f deg)", position >> settings.bits, counts, degrees);
}

bool IsNear(std::uint32_t position, std::uint32_t target, const Cia406Settings& settings) {
  return CircularDistance(position, target, std::int64_t{1} << settings.total_bits()) <=
         PresetToleranceCounts(settings.bits);
}

PositionReadout::PositionReadout(std::optional<std::uint32_t> target, const Cia406Settings& settings,
                                 const DeviceOutput& output, MonoNs deadline)
    : Readout(kPositionObjects, deadline), target_(target), settings_(settings), output_(output) {}

// A shaft that turns may have left the place where it was set.
Outcome PositionReadout::Show(const Values& values, MonoNs now) const {
  if (!values[0]) {
    return Final(CommandState::kFailed, Reason::REASON_DEVICE_REFUSED,
                 "the encoder does not let its position 6004h be read");
  }
  Outcome outcome = Verified(PositionText(*values[0], settings_));
  outcome.changes.push_back({"position", "", std::to_string(*values[0])});
  if (!target_) return outcome;
  const Motion motion = output_.MotionAt(now);
  const bool rests = motion.known && motion.standstill;
  const bool near = IsNear(*values[0], *target_, settings_);
  outcome.changes.push_back(FindingChange(near ? kReadsAsAfter : rests ? kNoEffectSeen : kCannotTell));
  return outcome;
}

IdentityReadout::IdentityReadout(MonoNs deadline) : Readout(kIdentityObjects, deadline) {}

Outcome IdentityReadout::Show(const Values& values, MonoNs) const {
  const std::uint32_t type = values[0].value_or(0);
  Outcome outcome = Verified(Text("device type 0x%08X: profile %u", type, type & 0xFFFF));
  for (std::size_t part = 0; part < kIdentityParts; ++part) {
    outcome.changes.push_back({kIdentityNames.at(part), "", Hex(values[part + 1], 8)});
  }
  return outcome;
}

StateReadout::StateReadout(const Interpreter& interpreter, MonoNs deadline)
    : Readout(kStateObjects, deadline), interpreter_(interpreter) {}

Outcome StateReadout::Show(const Values& values, MonoNs) const {
  const NodeWatch& watch = interpreter_.watch();
  std::string text = std::string("NMT state ") + (watch.state() ? NmtStateName(*watch.state()) : "not known");
  if (!watch.said()) text += " (no heartbeat says so)";
  text += "; errors: " + (values[0] ? ErrorRegisterText(static_cast<std::uint8_t>(*values[0])) : "not offered");
  if (const auto& emergency = interpreter_.alarms().last_emergency()) {
    text += Text("; last EMCY 0x%04X (%s), register 0x%02X, data %s", unsigned{emergency->code},
                 EmergencyClass(emergency->code), unsigned{emergency->error_register},
                 HexText(emergency->specific).c_str());
  }
  Outcome outcome = Verified(text);
  outcome.changes = {{"error_register", "", Hex(values[0], 2)},
                     {"operating_status", "", Hex(values[1], 4)},
                     {"alarms", "", Hex(values[2], 4)},
                     {"warnings", "", Hex(values[3], 4)}};
  return outcome;
}

}  // namespace axlecast::saa_can::cia406
