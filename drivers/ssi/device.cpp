#include <algorithm>
#include <array>
#include <axlecast/alarm_entry_t.hpp>
#include <axlecast/command_status_t.hpp>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "core/device/operation.h"
#include "drivers/kit/clocked_line.h"
#include "drivers/ssi/codec.h"
#include "drivers/ssi/family.h"
#include "drivers/ssi/settings.h"

namespace axlecast::ssi {

namespace {

constexpr std::uint8_t kDevice = alarm_entry_t::SOURCE_DEVICE;
constexpr std::uint8_t kDriver = alarm_entry_t::SOURCE_DRIVER;
constexpr std::uint8_t kWarning = alarm_entry_t::SEVERITY_WARNING;
constexpr std::uint8_t kError = alarm_entry_t::SEVERITY_ERROR;
constexpr std::int32_t kFirstStatus = 0x120;

struct LineAlarmRow {
  WordError error;
  AlarmSpec spec;
};
constexpr std::array<LineAlarmRow, 6> kLineAlarms = {{
    {WordError::kNoZero,
     {0x100, kDriver, kError, "no_encoder",
      "Data stays high: check power, data and clock wires, and the receiver"}},
    {WordError::kIdleLow,
     {0x101, kDriver, kError, "data_line_low",
      "Data is low before the clock: D+ and D- swapped, a short, or pause_us too short"}},
    {WordError::kRepeat,
     {0x102, kDriver, kError, "repeat_differs",
      "The words of one transfer differ: check cable, monoflop_us, bits and repeat"}},
    {WordError::kTrailing,
     {0x103, kDriver, kError, "trailing_bits",
      "What follows the word is not as configured: check bits, trailing, monoflop_us"}},
    {WordError::kPadding,
     {0x104, kDriver, kError, "padding_not_zero", "Unused bits are set: check bits, turn_bits, format, cable_m"}},
    {WordError::kParity, {0x105, kDriver, kError, "parity", "Parity fails: check parity, bits and the cable"}},
}};

// A status bit as an alarm. Its name is the configured one, and must outlive the alarm.
AlarmSpec StatusAlarm(const StatusBit& bit, std::size_t index) {
  return {kFirstStatus + static_cast<std::int32_t>(index), kDevice, bit.is_error ? kError : kWarning,
          bit.name.c_str(),
          bit.is_error ? "The encoder reports that its position is not valid: see its data sheet"
                       : "The encoder warns: see its data sheet"};
}

}  // namespace

const AlarmSpec* LineAlarm(WordError error) {
  for (const LineAlarmRow& row : kLineAlarms) {
    if (row.error == error) return &row.spec;
  }
  return nullptr;
}

std::vector<AlarmSpec> Alarms(const DeviceConfig& device) {
  const std::vector<StatusBit>& bits = Own(device).status_bits;
  std::vector<AlarmSpec> alarms;
  alarms.reserve(kLineAlarms.size() + bits.size());
  for (const LineAlarmRow& row : kLineAlarms) alarms.push_back(row.spec);
  for (std::size_t i = 0; i < bits.size(); ++i) alarms.push_back(StatusAlarm(bits[i], i));
  return alarms;
}

namespace {

// A transfer takes as long as its clocks, and the controller's driver ends it.
constexpr MonoNs kTimeout = 10 * kMillisecond;
constexpr int kAlarmAfter = 3;
// After this number of consecutive transfers without an encoder, it counts as gone, and is polled at this interval.
constexpr int kGone = 10;
constexpr MonoNs kLookAgain = 50 * kMillisecond;

// In the order of WordError. All ones: nobody answers. Checksum: what is redundant in the transfer disagrees.
ErrorKind KindOf(WordError error) {
  using K = ErrorKind;
  constexpr std::array kKinds = {K::kChecksum, K::kShort, K::kFraming, K::kTimeout,
                                 K::kChecksum, K::kRange, K::kRange,   K::kChecksum};
  return kKinds.at(static_cast<std::size_t>(error));
}

// One encoder on SSI: one transfer in each live slot. A transfer that failed is not repeated before the next slot. While
// there is no encoder, it is polled less often. SSI carries no commands.
class SsiDevice final : public Device {
 public:
  SsiDevice(const BusConfig&, const DeviceConfig& device, DeviceOutput& output)
      : owned_(device.settings),
        settings_(Own(device)),
        size_(TransferSize(settings_.format)),
        clocking_(settings_.spi.ClockTime(static_cast<std::int64_t>(size_) * 8)),
        output_(output) {}

  [[nodiscard]] Step Next(const BusSlot& slot) const override {
    if (!link_up_ || !slot.poll_due) return {.action = Idle{kNever}, .priority = Priority::kLive};
    if (slot.now < not_before_) return {.action = Idle{not_before_}, .priority = Priority::kLive};
    return {.action = ClockedExchange(size_, kTimeout), .priority = Priority::kLive};
  }
  void OnStarted(const Step&, MonoNs) override {}
  void On(const Event& event) override {
    switch (event.kind) {
      case Event::Kind::kReply:
        OnTransfer(event);
        break;
      case Event::Kind::kTimeout:
        output_.OnError(event.bytes.empty() ? ErrorKind::kTimeout : ErrorKind::kShort,
                        {event.sent.first, event.End()});
        break;
      case Event::Kind::kUnexpectedBytes:
        output_.OnError(ErrorKind::kUnexpectedBytes, event.received);
        break;
      case Event::Kind::kLinkUp:
        link_up_ = true;
        not_before_ = 0;
        break;
      case Event::Kind::kLinkDown:
        link_up_ = false;
        EndLineAlarm(event.End());
        break;
      default:
        break;
    }
  }
  [[nodiscard]] Result<> Validate(const DriverCommand&, MonoNs) const override {
    return Failure("SSI carries no commands: set a datum in software (axlecast home)",
                   command_status_t::REASON_UNKNOWN_OPERATION);
  }
  void Begin(const DriverCommand& command, MonoNs now) override {
    output_.OnOutcome(command.id, RefusedOutcome(Validate(command, now).error()));
  }
  [[nodiscard]] bool Cancel(const CommandId&, MonoNs) override { return false; }

 private:
  void OnTransfer(const Event& event) {
    // TWK SSI 4, SAA manual 5.5: the first falling edge stores the position. It comes after the request to clock, and all
    // of the clocks come after it.
    const Interval latch = {event.sent.first, std::max(event.sent.first, event.sent.last - clocking_)};
    const Word word = ParseTransfer(event.bytes, event.bytes.size() * 8, settings_.format);
    if (word.error != WordError::kNone) return OnWordError(word.error, latch);
    EndLineAlarm(event.End());
    OnWord(word, latch);
  }
  void OnWordError(WordError error, Interval at) {
    output_.OnError(KindOf(error), at);
    in_a_row_ = error == last_error_ ? std::min(in_a_row_ + 1, kGone) : 1;
    last_error_ = error;
    if (error == WordError::kNoZero && in_a_row_ == kGone) not_before_ = at.last + kLookAgain;
    if (in_a_row_ < kAlarmAfter) return;
    const AlarmSpec* alarm = LineAlarm(error);
    if (line_alarm_ != nullptr && line_alarm_ != alarm) output_.OnAlarm(*line_alarm_, AlarmState::kAbsent, at.last);
    line_alarm_ = alarm;
    if (alarm != nullptr) output_.OnAlarm(*alarm, AlarmState::kLive, at.last);
  }
  void EndLineAlarm(MonoNs now) {
    last_error_ = WordError::kNone;
    in_a_row_ = 0;
    if (line_alarm_ != nullptr) output_.OnAlarm(*std::exchange(line_alarm_, nullptr), AlarmState::kAbsent, now);
  }
  void OnWord(const Word& word, Interval at) {
    Sample sample{.at = at, .counts = word.counts};
    sample.turns = static_cast<std::int32_t>(word.turns);
    sample.has_turns = settings_.format.turn_bits > 0;
    for (std::size_t i = 0; i < settings_.status_bits.size(); ++i) {
      const StatusBit& bit = settings_.status_bits[i];
      const bool active = PlaceOf(settings_.format, word.value, bit.place) == bit.active_high;
      output_.OnAlarm(StatusAlarm(bit, i), active ? AlarmState::kLive : AlarmState::kAbsent, at.last);
      if (!active) continue;
      sample.device_status |= std::int32_t{1} << i;
      sample.error = sample.error || bit.is_error;
      sample.warning = sample.warning || !bit.is_error;
    }
    output_.OnSample(sample);
  }

  std::shared_ptr<const DeviceSettings> owned_;  // keeps settings_ alive
  const SsiSettings& settings_;
  const std::size_t size_;  // bytes of a transfer
  const MonoNs clocking_;   // time of its clocks, at least
  DeviceOutput& output_;

  bool link_up_ = false;
  MonoNs not_before_ = 0;  // there was no encoder
  WordError last_error_ = WordError::kNone;
  int in_a_row_ = 0;                       // transfers that failed with last_error_
  const AlarmSpec* line_alarm_ = nullptr;  // that is up
};

}  // namespace

std::unique_ptr<Device> MakeDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output) {
  return std::make_unique<SsiDevice>(bus, device, output);
}

}  // namespace axlecast::ssi
