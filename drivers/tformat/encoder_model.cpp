#include "drivers/tformat/encoder_model.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace axlecast::tformat {

void EncoderEeprom::Advance(MonoNs now) {
  if (!under_way_ || Busy(now)) return;
  cells_.at(under_way_->cell) = under_way_->data;
  under_way_.reset();
  ++writes_done_;
}

bool EncoderEeprom::Wear(MonoNs now) {
  busy_until_ = now + kWriteTime;
  if (wear_ >= kRewrites) return false;
  ++wear_;
  return true;
}

void EncoderEeprom::Write(std::uint8_t cell, std::uint8_t data, MonoNs now) {
  if (Wear(now)) {
    under_way_ = CellWrite{cell, data};
  } else {
    ++writes_lost_;
  }
}

bool EncoderEeprom::StoreZero(MonoNs now) { return Wear(now); }

void EncoderEeprom::PowerOff(MonoNs now) {
  Advance(now);
  if (under_way_) ++writes_lost_;
  under_way_.reset();
  busy_until_ = now;
}

bool ResetCounter::OnReset(std::uint8_t id, MonoNs now) {
  if (count_ > 0 && id != id_) Break();
  if (count_ > 0 && now - last_ < kInterval) {
    ++too_early_;
    Break();
    return false;
  }
  id_ = id;
  last_ = now;
  if (++count_ < kTimes) return false;
  count_ = 0;
  return true;
}

void ResetCounter::Break() {
  if (count_ > 0) ++broken_;
  count_ = 0;
}

namespace {

constexpr double kPowerOffRpm = 6'000;  // spec 5.4.2
constexpr MonoNs kPowerOffTimer = 5 * kSecond;
constexpr double kTimerAccel = 80'000;             // rad/s^2, within the power-off timer
constexpr double kPowerOffAccel = 4'000;           // rad/s^2, after it
constexpr double kSpeedSlack = 1e-6;               // rpm: rounding of a speed that was set exactly at a limit
constexpr ShaftAngle kDeviation = kShaftTurn / 8;  // of a counting error: 45 deg, above the 22.5 that raise it
constexpr int kFullAbsoluteBits = 5;

ShaftAngle Plus(ShaftAngle a, ShaftAngle b) {
  return static_cast<ShaftAngle>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
}

std::uint32_t LowBits(std::int64_t value, int bits) {
  return static_cast<std::uint32_t>(static_cast<std::uint64_t>(value) & ((std::uint64_t{1} << bits) - 1));
}

}  // namespace

EncoderModel::EncoderModel(const Settings& settings, ShaftAngle start)
    : settings_(settings),
      shaft_(start),
      random_(settings.seed),
      overflow_epoch_(TurnsAt(start) >> settings.multi_turn_bits) {}

std::int64_t EncoderModel::TurnsAt(ShaftAngle angle) const {
  return (Plus(angle, zero_offset_) >> kTurnBits) + turn_offset_;
}

void EncoderModel::SetTurns(std::int64_t turns) {
  turn_offset_ += turns - TurnsAt(shaft_.At(now_).angle);
  overflow_epoch_ = turns >> settings_.multi_turn_bits;
}

// ---- time ----

void EncoderModel::Advance(MonoNs now) {
  if (now >= zero_at_) {
    Track(zero_at_);
    ExecuteZero();
  }
  Track(now);
  eeprom_.Advance(now);
}

void EncoderModel::Track(MonoNs to) {
  if (to <= now_) return;
  const Shaft::Extent extent = shaft_.Over(now_, to);
  moved_ = moved_ || extent.fastest_rpm > 0;
  if (extent.slowest_rpm < kFullAbsoluteRpm - kSpeedSlack) full_absolute_ = false;
  const MonoNs from = std::exchange(now_, to);
  TrackOverflow(extent.lowest, extent.highest);
  if (!powered_) TrackPowerOff(from);
}

void EncoderModel::TrackOverflow(ShaftAngle lowest, ShaftAngle highest) {
  const std::int64_t low = TurnsAt(lowest) >> settings_.multi_turn_bits;
  const std::int64_t high = TurnsAt(highest) >> settings_.multi_turn_bits;
  const bool counting = settings_.multi_turn_bits > 0 && (powered_ || !memory_lost_);
  if (counting && !overflow_dead_ && (low != overflow_epoch_ || high != overflow_epoch_)) counter_overflow_ = true;
  overflow_epoch_ = TurnsAt(shaft_.At(now_).angle) >> settings_.multi_turn_bits;
}

bool EncoderModel::TooFastForPowerOff(MonoNs from, MonoNs to) const {
  const MonoNs timer_end = powered_off_ + kPowerOffTimer;
  const auto exceeds = [this](MonoNs begin, MonoNs end, double accel) {
    if (begin >= end) return false;
    const Shaft::Extent extent = shaft_.Over(begin, end);
    return extent.fastest_rpm > kPowerOffRpm + kSpeedSlack || extent.hardest_rad_s2 > accel * (1 + 1e-9);
  };
  return exceeds(from, std::min(to, timer_end), kTimerAccel) ||
         exceeds(std::max(from, timer_end), to, kPowerOffAccel);
}

void EncoderModel::TrackPowerOff(MonoNs from) {
  if (memory_lost_ || lost_turn_ || !TooFastForPowerOff(from, now_)) return;
  over_speed_ = true;
  lost_turn_ = true;
  const Shaft::State state = shaft_.At(now_);
  SetTurns(TurnsAt(state.angle) - (state.speed_rpm < 0 ? -1 : 1));
}

// ---- supply ----

void EncoderModel::SetPower(bool on, MonoNs now) {
  Advance(now);
  if (on == powered_) return;
  on ? PowerOn(now_) : PowerOff(now_);
}

void EncoderModel::PowerOff(MonoNs now) {
  powered_ = false;
  powered_off_ = now;
  lost_turn_ = false;
  memory_lost_ = !HasBattery();
  zero_at_ = kNever;
  reset_counter_.Break();
  eeprom_.PowerOff(now);
  full_absolute_ = false;
  counting_error_ = CountingError::kNone;
  multi_turn_error_ = false;  // "latched during main power-on"
}

void EncoderModel::PowerOn(MonoNs now) {
  powered_ = true;
  ready_ = now + (HasBattery() ? kStandbyWithBattery : kStandbyWithoutBattery);
  full_absolute_ = std::abs(shaft_.At(now).speed_rpm) >= kFullAbsoluteRpm - kSpeedSlack;
  if (memory_lost_) {
    over_speed_ = false;
    counter_overflow_ = false;
    SetTurns(0);
    LatchBatteryError();
    memory_lost_ = false;
  }
}

void EncoderModel::SetBattery(double volts, MonoNs now) {
  Advance(now);
  battery_volts_ = volts;
  if (HasBattery()) return;
  if (powered_) {
    LatchBatteryError();
  } else {
    memory_lost_ = true;
  }
}

void EncoderModel::LatchBatteryError() {
  battery_error_ = true;
  overflow_dead_ = true;
}

// ---- faults of the encoder itself ----

Shaft& EncoderModel::ShaftToTurn(MonoNs now) {
  Advance(now);
  return shaft_;
}

void EncoderModel::SetCountingError(CountingError error, MonoNs now) {
  Advance(now);
  counting_error_ = error;
}

void EncoderModel::JumpTurns(std::int64_t turns, MonoNs now) {
  Advance(now);
  turns_jumped_ += turns;
  turn_offset_ += turns;
  overflow_epoch_ = TurnsAt(shaft_.At(now_).angle) >> settings_.multi_turn_bits;
  if (powered_) multi_turn_error_ = true;
}

void EncoderModel::SetStuck(bool stuck, MonoNs now) {
  Advance(now);
  stuck_.reset();
  if (stuck) stuck_ = shaft_.At(now_).angle;
}

// ---- requests ----

EncoderModel::Reading EncoderModel::Read(MonoNs now) {
  Advance(now);
  ShaftAngle angle = stuck_.value_or(shaft_.At(now_).angle);
  const int unused_bits = kTurnBits - settings_.single_turn_bits;
  if (counting_error_ != CountingError::kNone) angle = Plus(angle, kDeviation);
  if (settings_.noise_counts > 0) angle = Plus(angle, random_.Around(settings_.noise_counts) << unused_bits);

  Reading reading;
  reading.single_turn = LowBits(Plus(angle, zero_offset_), kTurnBits) >> unused_bits;
  if (full_absolute_) reading.single_turn &= ~LowBits(-1, settings_.single_turn_bits - kFullAbsoluteBits);
  reading.multi_turn = LowBits(TurnsAt(angle), settings_.multi_turn_bits);
  reading.encoder_id = settings_.encoder_id;
  reading.over_speed = over_speed_;
  reading.full_absolute = full_absolute_;
  reading.counting_error = counting_error_ != CountingError::kNone;
  reading.counter_overflow = counter_overflow_;
  reading.multi_turn_error = multi_turn_error_;
  reading.battery_error = battery_error_;
  reading.battery_alarm = battery_volts_ <= kBatteryAlarmVolts;
  return reading;
}

void EncoderModel::OnOtherRequest() { reset_counter_.Break(); }

void EncoderModel::OnReset(std::uint8_t data_id, MonoNs now) {
  Advance(now);
  if (data_id == 0x8) {
    const bool first = reset_counter_.count() == 0;
    const bool moving = (!first && moved_) || shaft_.At(now_).speed_rpm != 0;
    moved_ = false;
    if (moving) {
      ++effects_.refused_zeroings;
      reset_counter_.Break();
      return;
    }
  }
  if (!reset_counter_.OnReset(data_id, now_)) return;
  if (data_id == 0x8) {
    if (eeprom_.StoreZero(now_)) zero_at_ = now_ + EncoderEeprom::kWriteTime;
    return;
  }
  ClearLatches();
  if (data_id == 0x7) {
    ++effects_.error_clears;
    return;
  }
  ++effects_.turn_resets;
  overflow_dead_ = false;
  SetTurns(0);
  if (!HasBattery()) LatchBatteryError();
}

void EncoderModel::ClearLatches() {
  over_speed_ = false;
  counter_overflow_ = false;
  multi_turn_error_ = false;
  if (counting_error_ == CountingError::kLatched) counting_error_ = CountingError::kNone;
  battery_error_ = !HasBattery();  // the cause is still there: it is raised again at once
}

// The multi-turn counter keeps its value: "one revolution data is reset".
void EncoderModel::ExecuteZero() {
  const ShaftAngle angle = shaft_.At(now_).angle;
  const std::int64_t turns = TurnsAt(angle);
  zero_offset_ = Plus(AngleFromDegrees(settings_.zero_error_deg), -angle);
  turn_offset_ += turns - TurnsAt(angle);
  zero_at_ = kNever;
  ++effects_.zeroings;
}

// ---- requests ----

namespace {

// Spec 6.3.1, Table 1, bit by bit: cc0 to cc3 and the parity cc4; with the length of the request (Figures 1 to 3).
struct TableRow {
  std::uint8_t data_id;
  std::array<std::uint8_t, 5> code;
  std::size_t request_size;
};
constexpr std::array<TableRow, 9> kTable1 = {{
    {0x0, {0, 0, 0, 0, 0}, 1},
    {0x1, {1, 0, 0, 0, 1}, 1},
    {0x2, {0, 1, 0, 0, 1}, 1},
    {0x3, {1, 1, 0, 0, 0}, 1},
    {0x6, {0, 1, 1, 0, 0}, 4},  // CF ADF EDF CRC
    {0xD, {1, 0, 1, 1, 1}, 3},  // CF ADF CRC
    {0x7, {1, 1, 1, 0, 1}, 1},
    {0x8, {0, 0, 0, 1, 1}, 1},
    {0xC, {0, 0, 1, 1, 0}, 1},
}};
constexpr std::array<std::uint8_t, 3> kSinkCode = {0, 1, 0};
constexpr std::uint8_t kLastUserCell = 79;

std::uint8_t BitOf(std::uint8_t byte, std::size_t bit) {
  return static_cast<std::uint8_t>(unsigned{byte} >> bit & 1U);
}

const TableRow* FindRow(std::uint8_t data_id) {
  for (const TableRow& row : kTable1) {
    if (row.data_id == data_id) return &row;
  }
  return nullptr;
}

// Remainder of division by X^8 + 1, bit by bit (spec 6.3.4): the bit that leaves the register comes back at its
// end.
std::uint8_t Remainder(Bytes bytes) {
  std::uint8_t rest = 0;
  for (const std::uint8_t byte : bytes) {
    for (std::size_t bit = 0; bit < 8; ++bit) {
      rest = static_cast<std::uint8_t>((rest >> 1U | rest << 7U) ^ (BitOf(byte, bit) << 7U));
    }
  }
  return rest;
}

bool HasSinkCode(std::uint8_t field) {
  for (std::size_t bit = 0; bit < kSinkCode.size(); ++bit) {
    if (BitOf(field, bit) != kSinkCode.at(bit)) return false;
  }
  return true;
}

}  // namespace

std::uint8_t TableControlField(std::uint8_t data_id) {
  const TableRow* row = FindRow(data_id);
  assert(row != nullptr);
  unsigned field = 0;
  for (std::size_t bit = 0; bit < kSinkCode.size(); ++bit) field |= unsigned{kSinkCode.at(bit)} << bit;
  for (std::size_t bit = 0; bit < row->code.size(); ++bit) field |= unsigned{row->code.at(bit)} << (3 + bit);
  return static_cast<std::uint8_t>(field);
}

SimulatedRequest CheckRequest(Bytes bytes, bool complete) {
  using Verdict = SimulatedRequest::Verdict;
  SimulatedRequest request;
  const std::uint8_t field = bytes.front();
  request.field = field;
  request.size = 1;
  if (!HasSinkCode(field)) {
    request.verdict = Verdict::kNoSync;
    return request;
  }
  request.data_id = static_cast<std::uint8_t>(field >> 3U & 0x0FU);
  for (std::size_t bit = 3; bit < 8; ++bit) request.parity_error ^= BitOf(field, bit) != 0;
  const TableRow* row = FindRow(request.data_id);
  if (row == nullptr || request.parity_error) {
    // Its length is unknown: the frame ends where the bytes end (spec 7.2).
    request.verdict = Verdict::kAbnormal;
    request.size = bytes.size();
    return request;
  }
  if (bytes.size() < row->request_size) {
    request.verdict = complete ? Verdict::kAbnormal : Verdict::kIncomplete;
    request.size = bytes.size();
    return request;
  }
  request.size = row->request_size;
  request.verdict = Verdict::kGood;
  if (row->request_size == 1) return request;
  request.address = bytes[1];
  if (row->request_size == 4) request.data = bytes[2];
  // The busy bit of a request is 0 (Table 4); an address above 79 includes it.
  const bool crc_fits = Remainder(bytes.first(row->request_size - 1)) == bytes[row->request_size - 1];
  if (!crc_fits || request.address > kLastUserCell) request.verdict = Verdict::kAbnormal;
  return request;
}

}  // namespace axlecast::tformat
