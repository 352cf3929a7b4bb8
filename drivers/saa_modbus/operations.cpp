#include "drivers/saa_modbus/operations.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>

#include "core/config/machine_config.h"
#include "core/device/operation.h"
#include "drivers/kit/arguments.h"
#include "drivers/saa_modbus/connection_procedures.h"
#include "drivers/saa_modbus/procedures.h"

namespace axlecast::saa_modbus {
namespace {

using Made = axlecast::Made<Procedure>;
using Reason = command_status_t;

constexpr std::string_view kZero = "zero";
constexpr std::string_view kSetDirection = "set_direction";
constexpr std::string_view kSetBaudRate = "set_baud";
constexpr std::string_view kNewAddress = "set_address";
constexpr std::string_view kAskForAddress = "query_address";
constexpr std::string_view kRead = "read_position";

const std::vector<OperationSpec>& Specs() {
  static const std::vector<OperationSpec> kSpecs = {
      {.name = kZero,
       .help = "Makes the present shaft angle the encoder's 0 (CC 00); writes its memory",
       .arguments = {},
       .destructive = true,
       .needs_standstill = true,
       .needs_permit = true,
       .moves_datum = true,
       .writes = &OneWrite,
       .verification = "the position reads 0 within 0.1 degrees or 2 counts, and the encoder's accuracy, if it "
                       "read otherwise before",
       .verified_by_operation = kRead},
      {.name = kSetDirection,
       .help = "Sets which way the encoder counts (CC 01 or 02); writes its memory. The position may jump",
       .arguments = {{"direction", "positive or negative"}},
       .destructive = true,
       .needs_standstill = true,
       .needs_permit = true,
       .moves_datum = true,
       .writes = &OneWrite,
       .verification = "none: the encoder's echo says that it was accepted; only a motion shows it",
       .verified_by_operation = kRead},
      {.name = kSetBaudRate,
       .help = "Changes the encoder's baud rate (CC); writes its memory. Only when it is alone on its bus",
       .arguments = {{"baud", "2400, 4800, 9600, 19200 or 57600"}},
       .destructive = true,
       .needs_permit = true,
       .writes = &OneWrite,
       .verification = "the encoder answers at the new rate",
       .verified_by_operation = kRead},
      {.name = kNewAddress,
       .help = "Changes the encoder's address (A1); writes its memory",
       .arguments = {{"address", "1 to 247, not used on this bus"},
                     {"from", "address at which the encoder answers now, default where it is asked", false}},
       .destructive = true,
       .needs_permit = true,
       .writes = &OneWrite,
       .verification = "the encoder answers at the new address",
       .verified_by_operation = kRead},
      {.name = kAskForAddress,
       .help = "Asks the encoder for its address, whatever it is (FF A0). Only when it is alone on its bus",
       .arguments = {},
       .reads_only = true,
       .verification = "it is a reading"},
      {.name = kRead,
       .help = "Reads the position once",
       .arguments = {{"after", "an operation with its arguments, to see whether it took effect", false}},
       .reads_only = true,
       .verification = "it is a reading"},
  };
  return kSpecs;
}

Made BadArgument(std::string_view text) { return Rejected(Reason::REASON_BAD_ARGUMENT, text); }
Made NotPermitted(std::string_view text) { return Rejected(Reason::REASON_NOT_PERMITTED, text); }

std::optional<Parameter> DirectionOf(const Arguments& arguments) {
  const std::string_view direction = FindArgument(arguments, "direction").value_or("");
  if (direction == "positive") return Parameter::kPositive;
  return direction == "negative" ? std::optional(Parameter::kNegative) : std::nullopt;
}

std::optional<std::uint8_t> AddressOf(const Arguments& arguments, std::string_view name, std::uint8_t fallback) {
  const std::optional<std::string_view> text = FindArgument(arguments, name);
  if (!text) return fallback;
  const std::optional<std::int64_t> address = ParseWhole(*text, kMinAddress, kMaxAddress);
  return address ? std::optional(static_cast<std::uint8_t>(*address)) : std::nullopt;
}

std::optional<std::int64_t> BaudArgument(const Arguments& arguments) {
  const auto baud = ParseWhole(FindArgument(arguments, "baud").value_or(""), 1, INT64_MAX);
  return baud && BaudParameter(*baud) ? baud : std::nullopt;
}

bool Others(const OperationContext& around, std::uint8_t address) {
  return std::find(around.other_addresses.begin(), around.other_addresses.end(), address) !=
         around.other_addresses.end();
}

constexpr std::string_view kBadAddress = "address and from must be 1 to 247";
constexpr std::string_view kBadBaud = "baud must be 2400, 4800, 9600, 19200 or 57600";

Made MakeDirection(const DriverCommand& order, const OperationContext& around) {
  const std::optional<Parameter> direction = DirectionOf(order.arguments);
  if (!direction) return BadArgument("direction must be positive or negative");
  return std::make_unique<DatumWrite>(*direction, around.settings, around.connection, around.output);
}

Made MakeSetBaud(const DriverCommand& order, const OperationContext& around) {
  const std::optional<std::int64_t> baud = BaudArgument(order.arguments);
  if (!baud) return BadArgument(kBadBaud);
  if (!around.other_addresses.empty()) {
    return NotPermitted(
        "the bus has other encoders, which would not follow: connect this one alone, and give it a "
        "bus of its own in the file");
  }
  return std::make_unique<SetBaud>(*baud, around.connection);
}

Made MakeSetAddress(const DriverCommand& order, const OperationContext& around) {
  const auto to = AddressOf(order.arguments, "address", 0);
  const auto from = AddressOf(order.arguments, "from", around.connection.address);
  if (!to || *to == 0 || !from) return BadArgument(kBadAddress);
  if (Others(around, *to)) return NotPermitted(Text("address %d is another encoder's of this bus", int{*to}));
  if (Others(around, *from)) {
    return NotPermitted(
        Text("address %d is another encoder's of this bus: give the order to that device", int{*from}));
  }
  return std::make_unique<SetAddress>(*from, *to, around.connection);
}

Made MakeQuery(const OperationContext& around) {
  if (!around.other_addresses.empty()) {
    return NotPermitted(
        "the question goes to every encoder on the bus, and all would answer at once: connect this "
        "one alone, and give it a bus of its own in the file");
  }
  return std::make_unique<AskAddress>(around.connection);
}

// Whether the operation that `after` tells of took effect.
Made MakeLook(const std::string& text, const OperationContext& around) {
  const CommandLine after = ParseCommandLine(text);
  const auto read = [&](Parameter parameter) -> Made {
    return std::make_unique<ReadPosition>(parameter, around.settings, around.connection, around.output);
  };
  const auto find = [&](Search::Place place) -> Made {
    return std::make_unique<FindEncoder>(place, text, around.settings, around.connection);
  };
  if (after.operation == kZero) return read(Parameter::kZero);
  if (after.operation == kSetDirection) {
    const std::optional<Parameter> direction = DirectionOf(after.arguments);
    return direction ? read(*direction) : BadArgument("after names a direction: positive or negative");
  }
  if (after.operation == kNewAddress) {
    const auto to = AddressOf(after.arguments, "address", 0);
    if (!to || *to == 0 || Others(around, *to)) return BadArgument("after names an address: 1 to 247, of no other");
    return find({*to, around.connection.baud});
  }
  if (after.operation == kSetBaudRate) {
    const std::optional<std::int64_t> baud = BaudArgument(after.arguments);
    if (!baud || !around.other_addresses.empty())
      return BadArgument("after names a rate, of an encoder that is alone");
    return find({around.connection.address, *baud});
  }
  return BadArgument("after must be zero, set_direction, set_address or set_baud with its arguments");
}

}  // namespace

std::span<const OperationSpec> Operations() { return Specs(); }

// The other encoders of the bus would take what is sent to all of them, or would not follow a new rate.
bool Permits(const BusConfig& bus, const DeviceConfig&, std::string_view operation) {
  return (operation != kSetBaudRate && operation != kAskForAddress) || bus.devices.size() <= 1;
}

const OperationSpec* FindOperation(std::string_view name) {
  const auto& specs = Specs();
  const auto found = std::find_if(specs.begin(), specs.end(), [&](const auto& spec) { return spec.name == name; });
  return found == specs.end() ? nullptr : &*found;
}

bool LooksElsewhere(const DriverCommand& order) {
  return order.operation == kAskForAddress || FindArgument(order.arguments, "from") ||
         FindArgument(order.arguments, "after");
}

bool Writes(std::string_view operation) {
  const OperationSpec* spec = FindOperation(operation);
  return spec != nullptr && spec->writes != nullptr;
}

Made MakeProcedure(const DriverCommand& order, const OperationContext& around) {
  if (order.operation == kZero) {
    return std::make_unique<DatumWrite>(Parameter::kZero, around.settings, around.connection, around.output);
  }
  if (order.operation == kSetDirection) return MakeDirection(order, around);
  if (order.operation == kSetBaudRate) return MakeSetBaud(order, around);
  if (order.operation == kNewAddress) return MakeSetAddress(order, around);
  if (order.operation == kAskForAddress) return MakeQuery(around);
  if (order.operation != kRead) {
    return Rejected(Reason::REASON_UNKNOWN_OPERATION, "saa_modbus has no operation " + order.operation);
  }
  if (const auto after = FindArgument(order.arguments, "after")) return MakeLook(std::string(*after), around);
  return std::make_unique<ReadPosition>(std::nullopt, around.settings, around.connection, around.output);
}

}  // namespace axlecast::saa_modbus
