#include "drivers/tsubaki_sc/simulator/sc_unit.h"

#include <algorithm>
#include <array>
#include <span>
#include <utility>

namespace axlecast::tsubaki_sc::simulator {
namespace {

constexpr std::array<Block, 3> kCoils = {{{0, 0, true}, {100, 100, true}, {200, 200, true}}};
constexpr std::array<Block, 1> kInputs = {{{0, 0}}};
constexpr std::array<Block, 4> kInputRegisters = {{{0, 8}, {100, 106}, {200, 204}, {300, 300}}};
constexpr std::array<Block, 5> kHoldingRegisters = {{{0, 54, true},
                                                     {100, 107, true, true},
                                                     {200, 207, true, true},
                                                     {300, 301, false, true},
                                                     {350, 354, false, true}}};

// Log data 1-3: 1000-1019 for the voltage to 1600-1619 for the acceleration on Z, then 2000.. and 3000..
constexpr std::array<Block, 21> LogBlocks() {
  std::array<Block, 21> blocks{};
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const auto first = static_cast<std::uint16_t>(1000 * (1 + i / 7) + 100 * (i % 7));
    blocks[i] = {first, static_cast<std::uint16_t>(first + 19)};
  }
  return blocks;
}
constexpr std::array<Block, 21> kLogs = LogBlocks();

const Block* Find(std::span<const Block> blocks, std::uint16_t address) {
  for (const Block& block : blocks) {
    if (address >= block.first && address <= block.last) return &block;
  }
  return nullptr;
}

constexpr std::size_t kParametersPerSet = 13;
constexpr std::uint16_t kLoggedIn = 0xFF00;

// The guideline names no factory settings. These differ in every address, so that a mix-up is seen, and let the
// default load run.
std::array<std::uint16_t, kParameterCount> DeliveredParameters() {
  std::array<std::uint16_t, kParameterCount> values{};
  constexpr std::array<int, kParametersPerSet> kUsual = {4000, 4050, 7000, 7050, 500, 505, 200,
                                                         205,  20,   10,   2,    30,  5};
  for (std::size_t address = 0; address < kOverheatLimit; ++address) {
    const auto set = static_cast<int>(address / kParametersPerSet);
    const std::size_t in_set = address % kParametersPerSet;
    values.at(address) = static_cast<std::uint16_t>(kUsual.at(in_set) + (in_set < 8 ? 10 * set : set));
  }
  values[kOverheatLimit] = 900;         // 90 C
  values[kExcessiveShockLimit] = 5000;  // 50 m/s^2
  values[kLogInterval] = 10;            // 1 s
  return values;
}

std::uint8_t CharacterAt(const std::string& text, std::size_t index) {
  return index < text.size() ? static_cast<std::uint8_t>(text[index]) : std::uint8_t{0};
}

}  // namespace

const Block* BlockAt(Space space, std::uint16_t address) {
  switch (space) {
    case Space::kCoil:
      return Find(kCoils, address);
    case Space::kInputStatus:
      return Find(kInputs, address);
    case Space::kInputRegister: {
      const Block* block = Find(kInputRegisters, address);
      return block != nullptr ? block : Find(kLogs, address);
    }
    case Space::kHoldingRegister:
      return Find(kHoldingRegisters, address);
  }
  return nullptr;
}

Range ParameterRange(std::uint16_t address) {
  switch (address) {
    case kOverheatLimit:
      return {0, 1250};
    case kExcessiveShockLimit:
      return {0, 15'000};
    case kLogInterval:
      return {1, 100};
    default:
      break;
  }
  const int in_set = address % 13;  // each DIP switch setting has 13
  if (in_set < 8) return {0, 10'000};
  return in_set == 8 ? Range{1, 50} : Range{0, 300};
}

WrittenPassword Unpadded(const Characters& characters) {
  std::size_t length = characters.size();
  while (length > 0 && (characters[length - 1] == 0x00 || characters[length - 1] == 0x20)) --length;
  WrittenPassword written;
  written.text.assign(characters.begin(), characters.begin() + static_cast<std::ptrdiff_t>(length));
  written.length_fits = length >= 8;
  written.characters_fit =
      std::all_of(written.text.begin(), written.text.end(), [](char c) { return c >= 0x21 && c <= 0x7E; });
  return written;
}

bool Access::Authenticate(std::string_view password) {
  if (password != password_) return false;
  logged_in_ = !logged_in_;
  return true;
}

Characters Access::password() const {
  Characters characters{};
  std::copy(password_.begin(), password_.end(), characters.begin());
  return characters;
}

ScUnit::ScUnit(std::uint64_t seed) : motor(seed), parameters_(DeliveredParameters()) {}

// ---- time ----

void ScUnit::Advance(MonoNs now) {
  if (!begun_) {
    begun_ = true;
    now_ = stepped_ = now;
    if (powered_) PowerOn();
    return;
  }
  while (now - stepped_ >= GearMotor::kStep) {
    stepped_ += GearMotor::kStep;
    now_ = stepped_;
    Step();
  }
  now_ = std::max(now_, now);
}

void ScUnit::Step() {
  motor.Step(now_);
  if (!powered_) return;
  const Record record = RecordOf(motor.At(now_));
  history_.Add(record);
  if (!motor.running()) return;
  const std::uint16_t causes = protection_.Causes(record, CurrentLimits(), now_);
  if (causes != 0) Trip(causes);
}

void ScUnit::Trip(std::uint16_t causes) {
  motor.Stop();
  motor_status_ = causes;
  if (trip_count_ < UINT16_MAX) ++trip_count_;
  logs_.Shift(causes, history_, parameters_[kLogInterval]);
}

bool ScUnit::ForceTrip(std::uint16_t cause) {
  if (!powered_ || !motor.running()) return false;
  const Limits limits = CurrentLimits();
  Record record = RecordOf(motor.At(now_));
  const auto above = [](int limit, int present) {
    return static_cast<std::uint16_t>(std::max(limit, present) + 1);
  };
  if (cause == kOverheat) {
    record[kTemperatureIndex] = above(limits.overheat, static_cast<std::int16_t>(record[kTemperatureIndex]));
  } else if (cause == kExcessiveShock) {
    record[kAccelIndex] = above(limits.excessive_shock, 0);
  } else if (cause == kUpperA || cause == kUpperB) {
    record[kPowerIndex] = above(limits.power[cause == kUpperA ? 0 : 1], record[kPowerIndex]);
  } else {
    const std::uint16_t limit = limits.power[cause == kLowerA ? 2 : 3];
    if (limit != 0)
      record[kPowerIndex] = std::min<std::uint16_t>(record[kPowerIndex], static_cast<std::uint16_t>(limit - 1));
  }
  history_.ReplaceNewest(record);
  Trip(cause);
  return true;
}

// ---- power and motor ----

void ScUnit::SetPower(bool on) {
  if (on == powered_) return;
  powered_ = on;
  if (!begun_) return;
  if (on) return PowerOn();
  motor.Stop();
  access.LogOut();
}

void ScUnit::PowerOn() {
  stop_ = false;
  motor_status_ = 0;
  history_.Clear();
  StartMotor();
}

void ScUnit::StartMotor() {
  if (motor.running()) return;
  ++effects.starts;
  motor.Start(now_);
  protection_.Begin(now_);
}

void ScUnit::SetStuck(bool stuck) {
  if (!stuck) {
    stuck_.reset();
  } else if (!stuck_) {
    stuck_ = RecordOf(motor.At(now_));
  }
}

// ---- reading ----

// Guideline 11: of each DIP switch setting, four power limits for 50 and 60 Hz alternately, the start time, four shock
// times.
std::uint16_t ScUnit::SetParameter(std::size_t index) const {
  const std::size_t first = kParametersPerSet * (static_cast<std::size_t>(settings.dip_set) - 1);
  const std::size_t mains = settings.mains_60_hz ? 1 : 0;
  return parameters_.at(first + (index < 4 ? 2 * index + mains : index + 4));
}

Limits ScUnit::CurrentLimits() const {
  Limits limits;
  for (std::size_t i = 0; i < 4; ++i) {
    limits.power.at(i) = SetParameter(i);
    limits.shock_time.at(i) = SetParameter(5 + i);
  }
  limits.start_time = SetParameter(4);
  limits.overheat = parameters_[kOverheatLimit];
  limits.excessive_shock = parameters_[kExcessiveShockLimit];
  return limits;
}

std::uint16_t ScUnit::LogSample(std::uint16_t address) const {
  return logs_.sample(address / 1000U - 1U, address / 100U % 10U, address % 100U);
}

std::uint16_t ScUnit::InputRegister(std::uint16_t address) const {
  if (address <= 8) return SetParameter(address);
  if (address >= 1000) return LogSample(address);
  if (address <= 106) return (stuck_ ? *stuck_ : RecordOf(motor.At(now_))).at(address - 100U);
  switch (address) {
    case 200:
      return trip_count_;
    case 201:
      return motor_status_;
    case 300:
      return access.logged_in() ? kLoggedIn : 0;
    default:
      return logs_.factor(address - 202U);
  }
}

std::uint16_t ScUnit::Pair(std::uint8_t first, std::uint8_t second) const {
  if (settings.low_character_first) std::swap(first, second);
  return static_cast<std::uint16_t>(first << 8U | second);
}

std::uint16_t ScUnit::HoldingRegister(std::uint16_t address) const {
  if (address < kParameterCount) return parameters_[address];
  if (address < kPassword) return 0;  // Login/Logout reads as NUL
  if (address < kProductCode) {
    const Characters characters = access.password();
    const std::size_t at = 2 * static_cast<std::size_t>(address - kPassword);
    return Pair(characters.at(at), characters.at(at + 1));
  }
  const bool product = address < kMfgNumber;
  const std::string& text = product ? settings.product_code : settings.mfg_number;
  const std::size_t at = 2 * static_cast<std::size_t>(address - (product ? kProductCode : kMfgNumber));
  return Pair(CharacterAt(text, at), CharacterAt(text, at + 1));
}

// ---- writing ----

void ScUnit::WriteCoil(std::uint16_t address, bool on) {
  if (!on) return;
  switch (address) {
    case kCoilClearTripCount:
      trip_count_ = 0;
      ++effects.trip_count_clears;
      break;
    case kCoilStop:
      if (motor.running()) ++effects.stops;
      stop_ = true;
      motor.Stop();
      break;
    default:
      stop_ = false;
      if (motor_status_ == 0) StartMotor();
      break;
  }
}

void ScUnit::WriteParameter(std::uint16_t address, std::uint16_t value) {
  const Range range = ParameterRange(address);
  ++effects.parameter_writes;
  if (settings.out_of_range == OutOfRange::kKeep && (value < range.low || value > range.high)) return;
  parameters_.at(address) = std::clamp(value, range.low, range.high);
}

bool ScUnit::WriteLogin(const std::string& password) {
  if (!access.Authenticate(password)) {
    ++effects.wrong_passwords;
    return false;
  }
  ++(access.logged_in() ? effects.logins : effects.logouts);
  return true;
}

void ScUnit::WritePassword(std::string password) {
  access.SetPassword(std::move(password));
  ++effects.password_changes;
}

}  // namespace axlecast::tsubaki_sc::simulator
