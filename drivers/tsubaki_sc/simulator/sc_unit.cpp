#include "drivers/tsubaki_sc/simulator/sc_unit.h"

#include <span>

namespace axlecast::tsubaki_sc::simulator {
namespace {

// ---- the data address list: guideline 7 ----

constexpr std::array<Block, 3> kCoils = {{{0, 0, true}, {100, 100, true}, {200, 200, true}}};
constexpr std::array<Block, 1> kInputs = {{{0, 0}}};
constexpr std::array<Block, 4> kInputRegisters = {{{0, 8}, {100, 106}, {200, 204}, {300, 300}}};
constexpr std::array<Block, 5> kHoldingRegisters = {{{0, 54, true},
                                                     {100, 107, true, true},
                                                     {200, 207, true, true},
                                                     {300, 301, false, true},
                                                     {350, 354, false, true}}};

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

// ---- commands ----

using Response = std::vector<std::uint8_t>;

// Guideline 6.
struct Function {
  std::uint8_t code;
  Space space;
  bool write;
  bool multiple;  // a write with a number of data and their bytes
};
constexpr std::uint8_t kReportSlaveId = 0x11;
constexpr std::array<Function, 8> kFunctions = {{{0x01, Space::kCoil, false, false},
                                                 {0x02, Space::kInputStatus, false, false},
                                                 {0x03, Space::kHoldingRegister, false, false},
                                                 {0x04, Space::kInputRegister, false, false},
                                                 {0x05, Space::kCoil, true, false},
                                                 {0x06, Space::kHoldingRegister, true, false},
                                                 {0x0F, Space::kCoil, true, true},
                                                 {0x10, Space::kHoldingRegister, true, true}}};

const Function* FindFunction(std::uint8_t code) {
  const auto* found =
      std::find_if(kFunctions.begin(), kFunctions.end(), [&](const Function& f) { return f.code == code; });
  return found == kFunctions.end() ? nullptr : found;
}

std::uint16_t Word(Bytes bytes, std::size_t at) {
  return static_cast<std::uint16_t>(bytes[at] << 8U | bytes[at + 1]);
}

bool IsRegister(Space space) { return space == Space::kHoldingRegister || space == Space::kInputRegister; }

// A command of function 01-10 with its sizes taken apart.
struct Command {
  const Function* function = nullptr;
  std::uint16_t start = 0;
  std::uint32_t count = 0;
  Bytes data;  // of a write: what is to be written
  bool sizes_fit = false;
};

Command TakeApart(const Function& function, Bytes bytes) {
  Command command;
  command.function = &function;
  command.start = Word(bytes, 1);
  command.count = function.write && !function.multiple ? 1 : Word(bytes, 3);
  if (!function.multiple) {
    command.data = bytes.subspan(3);
    command.sizes_fit = bytes.size() == 5 && command.count > 0;
    return command;
  }
  if (bytes.size() < 6) return command;
  command.data = bytes.subspan(6);
  const std::uint32_t size = IsRegister(function.space) ? 2 * command.count : (command.count + 7) / 8;
  command.sizes_fit = command.count > 0 && bytes[5] == size && command.data.size() == size;
  return command;
}

// ---- registers on the line ----

std::uint16_t RegisterAt(const ScUnit& unit, Bytes data, std::size_t index) {
  const std::uint16_t word = Word(data, 2 * index);
  return unit.settings.low_byte_first ? static_cast<std::uint16_t>(word << 8U | word >> 8U) : word;
}

void AppendRegister(const ScUnit& unit, Response& response, std::uint16_t value) {
  auto high = static_cast<std::uint8_t>(value >> 8U);
  auto low = static_cast<std::uint8_t>(value);
  if (unit.settings.low_byte_first) std::swap(high, low);
  response.push_back(high);
  response.push_back(low);
}

WrittenPassword PasswordIn(const ScUnit& unit, Bytes data) {
  Characters characters{};
  for (std::size_t i = 0; i < characters.size(); i += 2) {
    const std::uint16_t value = RegisterAt(unit, data, i / 2);
    characters.at(i) = static_cast<std::uint8_t>(value >> 8U);
    characters.at(i + 1) = static_cast<std::uint8_t>(value);
    if (unit.settings.low_character_first) std::swap(characters.at(i), characters.at(i + 1));
  }
  return Unpadded(characters);
}

// ---- checks, in the order of their error codes ----

bool AddressFits(const Command& command, const std::optional<Block>& block) {
  if (!block) return false;
  const std::uint32_t last = command.start + std::max<std::uint32_t>(command.count, 1) - 1;
  return last <= block->last && (block->writable || !command.function->write);
}

bool ParametersFit(const ScUnit& unit, const Command& command) {
  if (unit.settings.out_of_range != ScUnit::OutOfRange::kRefuse) return true;
  for (std::uint16_t i = 0; i < command.count; ++i) {
    const std::uint16_t value = RegisterAt(unit, command.data, i);
    const Range range = ParameterRange(static_cast<std::uint16_t>(command.start + i));
    if (value < range.low || value > range.high) return false;
  }
  return true;
}

bool DataFit(const ScUnit& unit, const Command& command, const Block& block) {
  if (!command.sizes_fit) return false;
  if (block.whole && (command.start != block.first || command.count != block.size())) return false;
  if (!command.function->write) return true;
  if (command.function->space == Space::kCoil) {
    const bool single = !command.function->multiple;
    return !single || Word(command.data, 0) == 0xFF00 || Word(command.data, 0) == 0x0000;
  }
  if (block.first == kParameters) return ParametersFit(unit, command);
  const WrittenPassword written = PasswordIn(unit, command.data);
  // A login with another character is a wrong password; as a new password it cannot be stored.
  return written.length_fits && (written.characters_fit || block.first == kLoginLogout);
}

bool LoginFits(const ScUnit& unit, const Command& command, const Block& block) {
  if (unit.access.logged_in()) return true;
  const bool holding = command.function->space == Space::kHoldingRegister;
  if (command.function->write) return holding && block.first == kLoginLogout;
  return !holding || block.first != kPassword;
}

// ---- execution ----

Response Read(const ScUnit& unit, const Command& command) {
  Response response = {command.function->code, 0};
  if (!IsRegister(command.function->space)) {
    const bool on = command.function->space == Space::kCoil ? unit.Coil(command.start) : unit.InputStatus();
    response[1] = 1;  // no two coils or inputs have consecutive addresses
    response.push_back(on ? 0x01 : 0x00);
    return response;
  }
  response[1] = static_cast<std::uint8_t>(2 * command.count);
  for (std::uint32_t i = 0; i < command.count; ++i) {
    const auto address = static_cast<std::uint16_t>(command.start + i);
    const bool holding = command.function->space == Space::kHoldingRegister;
    AppendRegister(unit, response, holding ? unit.HoldingRegister(address) : unit.InputRegister(address));
  }
  return response;
}

// Returns false if the password was wrong.
bool Write(ScUnit& unit, const Command& command, const Block& block) {
  if (command.function->space == Space::kCoil) {
    unit.WriteCoil(command.start, (command.data[0] & (command.function->multiple ? 0x01U : 0xFFU)) != 0);
    return true;
  }
  if (block.first == kLoginLogout) return unit.WriteLogin(PasswordIn(unit, command.data).text);
  if (block.first == kPassword) {
    unit.WritePassword(PasswordIn(unit, command.data).text);
    return true;
  }
  for (std::uint16_t i = 0; i < command.count; ++i) {
    unit.WriteParameter(static_cast<std::uint16_t>(command.start + i), RegisterAt(unit, command.data, i));
  }
  return true;
}

Response Error(std::uint8_t function, ErrorCode code) {
  return ErrorResponse(function, static_cast<std::uint8_t>(code));
}

}  // namespace

ScUnit::ScUnit(std::uint64_t seed) : motor(seed), parameters_(DeliveredParameters()) {}

std::optional<Block> BlockAt(Space space, std::uint16_t address) {
  // Log data 1-3: 1000-1019 for the voltage to 1600-1619 for the acceleration on Z, then 2000.. and 3000..
  const bool log = address >= 1000 && address < 4000 && address / 100 % 10 < 7 && address % 100 < 20;
  if (space == Space::kInputRegister && log) {
    const int first = address - address % 100;
    return Block{static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(first + 19)};
  }
  const std::array<std::span<const Block>, 4> spaces = {kCoils, kInputs, kInputRegisters, kHoldingRegisters};
  for (const Block& block : spaces.at(static_cast<std::size_t>(space))) {
    if (address >= block.first && address <= block.last) return block;
  }
  return std::nullopt;
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

std::uint16_t ErrorCheck(Bytes message) {
  unsigned crc = 0xFFFF;
  for (const std::uint8_t byte : message) {
    crc ^= byte;
    for (int shift = 0; shift < 8; ++shift) {
      const bool shifted_out = (crc & 1U) != 0;
      crc >>= 1U;
      if (shifted_out) crc ^= 0xA001U;
    }
  }
  return static_cast<std::uint16_t>(crc);
}

std::size_t CommandLength(Bytes so_far) {
  if (so_far.size() < 2) return 0;
  if (so_far[1] == kReportSlaveId) return 4;
  const Function* function = FindFunction(so_far[1]);
  if (function == nullptr) return 0;
  if (!function->multiple) return 8;
  return so_far.size() < 7 ? 0 : 9U + so_far[6];
}

bool IsWrite(std::uint8_t function) {
  const Function* found = FindFunction(function);
  return found != nullptr && found->write;
}

Response ErrorResponse(std::uint8_t function, std::uint8_t code) {
  return {static_cast<std::uint8_t>(function | 0x80U), code};
}

Response Execute(ScUnit& unit, Bytes bytes) {
  const std::uint8_t code = bytes[0];
  if (code == kReportSlaveId) {
    if (bytes.size() != 1) return Error(code, ErrorCode::kData);
    return {code, unit.settings.version[0], unit.settings.version[1]};
  }
  const Function* function = FindFunction(code);
  if (function == nullptr) return Error(code, ErrorCode::kFunction);
  if (bytes.size() < 5) return Error(code, ErrorCode::kData);
  const Command command = TakeApart(*function, bytes);
  const std::optional<Block> block = BlockAt(function->space, command.start);
  if (!AddressFits(command, block)) return Error(code, ErrorCode::kAddress);
  if (!DataFit(unit, command, *block)) return Error(code, ErrorCode::kData);
  if (!LoginFits(unit, command, *block)) return Error(code, ErrorCode::kLogin);
  if (!function->write) return Read(unit, command);
  if (!Write(unit, command, *block)) return Error(code, ErrorCode::kLogin);
  // Function, address and value or number again.
  return {bytes.begin(), bytes.begin() + 5};
}

}  // namespace axlecast::tsubaki_sc::simulator
