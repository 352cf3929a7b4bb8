#include "drivers/saa_modbus/operations.h"

#include <algorithm>

#include "core/config/machine_config.h"
#include "drivers/kit/arguments.h"

namespace axlecast::saa_modbus {
namespace {

using Made = Result<std::unique_ptr<Procedure>>;

constexpr std::string_view kZeroName = "zero";
constexpr std::string_view kSetDirectionName = "set_direction";
constexpr std::string_view kSetBaudName = "set_baud";
constexpr std::string_view kSetAddressName = "set_address";
constexpr std::string_view kQueryAddressName = "query_address";
constexpr std::string_view kReadPositionName = "read_position";

// An operation that writes the encoder's memory once.
OperationSpec MemoryWrite(OperationSpec operation) {
  operation.destructive = operation.needs_permit = true;
  operation.writes = &OneWrite;
  operation.verified_by_operation = kReadPositionName;
  return operation;
}

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

bool IsTaken(const OperationContext& context, std::uint8_t address) {
  return std::ranges::find(context.other_addresses, address) != context.other_addresses.end();
}

Place PlaceOf(const OperationContext& context) { return {context.connection.address, context.connection.baud}; }

Made MakeDirection(const DriverCommand& command, const OperationContext& context) {
  const std::optional<Parameter> direction = DirectionOf(command.arguments);
  if (!direction) return BadArgument("direction must be positive or negative");
  return MakeDatumWrite(*direction, context);
}

Made MakeSetBaud(const DriverCommand& command, const OperationContext& context) {
  const std::optional<std::int64_t> baud = BaudArgument(command.arguments);
  if (!baud) return BadArgument("baud must be 2400, 4800, 9600, 19200 or 57600");
  if (!context.other_addresses.empty()) {
    return NotPermitted(
        "the bus has other encoders, which would not follow: connect this one alone, and give it a "
        "bus of its own in the file");
  }
  const Place from = PlaceOf(context);
  return MakeConnectionChange(ConnectionKey::kBaud, from, {from.address, *baud}, context.connection);
}

Made MakeSetAddress(const DriverCommand& command, const OperationContext& context) {
  const auto to = AddressOf(command.arguments, "address", 0);
  const auto from = AddressOf(command.arguments, "from", context.connection.address);
  if (!to || *to == 0 || !from) return BadArgument("address and from must be 1 to 247");
  if (IsTaken(context, *to)) return NotPermitted(Text("address %d is another encoder's of this bus", int{*to}));
  if (IsTaken(context, *from)) {
    return NotPermitted(
        Text("address %d is another encoder's of this bus: give the command to that device", int{*from}));
  }
  const std::int64_t baud = context.connection.baud;
  return MakeConnectionChange(ConnectionKey::kAddress, {*from, baud}, {*to, baud}, context.connection);
}

Made MakeQuery(const OperationContext& context) {
  if (!context.other_addresses.empty()) {
    return NotPermitted(
        "the question goes to every encoder on the bus, and all would answer at once: connect this "
        "one alone, and give it a bus of its own in the file");
  }
  return MakeQueryAddress(context.connection);
}

// Returns the procedure that verifies the operation in the argument `after`.
Made MakeLook(const std::string& text, const OperationContext& context) {
  const CommandLine after = ParseCommandLine(text);
  const Place present = PlaceOf(context);
  if (after.operation == kZeroName) return MakeReadPosition(Parameter::kZero, context);
  if (after.operation == kSetDirectionName) {
    const std::optional<Parameter> direction = DirectionOf(after.arguments);
    if (!direction) return BadArgument("after names a direction: positive or negative");
    return MakeReadPosition(*direction, context);
  }
  if (after.operation == kSetAddressName) {
    const auto to = AddressOf(after.arguments, "address", 0);
    if (!to || *to == 0 || IsTaken(context, *to))
      return BadArgument("after names an address: 1 to 247, of no other");
    return MakeFindEncoder({*to, present.baud}, text, context);
  }
  if (after.operation == kSetBaudName) {
    const std::optional<std::int64_t> baud = BaudArgument(after.arguments);
    if (!baud || !context.other_addresses.empty())
      return BadArgument("after names a rate, of an encoder that is alone");
    return MakeFindEncoder({present.address, *baud}, text, context);
  }
  return BadArgument("after must be zero, set_direction, set_address or set_baud with its arguments");
}

}  // namespace

std::span<const OperationSpec> Operations() {
  static const std::vector<OperationSpec> kOperations = {
      MovingDatum({.name = kZeroName,
                   .help = "Makes the present shaft angle the encoder's 0 (CC 00); writes its memory",
                   .verification =
                       "the position reads 0 within 0.1 degrees or 2 counts, and the encoder's accuracy, if it "
                       "read otherwise before",
                   .verified_by_operation = kReadPositionName}),
      MovingDatum(
          {.name = kSetDirectionName,
           .help = "Sets which way the encoder counts (CC 01 or 02); writes its memory. The position may jump",
           .arguments = {{"direction", "positive or negative"}},
           .verification = "none: the encoder's echo shows that it was accepted; only a motion shows the direction",
           .verified_by_operation = kReadPositionName}),
      MemoryWrite(
          {.name = kSetBaudName,
           .help = "Changes the encoder's baud rate (CC); writes its memory. Only when it is alone on its bus",
           .arguments = {{"baud", "2400, 4800, 9600, 19200 or 57600"}},
           .verification = "the encoder answers at the new rate"}),
      MemoryWrite(
          {.name = kSetAddressName,
           .help = "Changes the encoder's address (A1); writes its memory",
           .arguments = {{"address", "1 to 247, not used on this bus"},
                         {"from", "address at which the encoder answers now, default where it is asked", false}},
           .verification = "the encoder answers at the new address"}),
      ReadOnly(
          {.name = kQueryAddressName,
           .help = "Asks the encoder for its address, whatever it is (FF A0). Only when it is alone on its bus"}),
      ReadOnly({.name = kReadPositionName, .help = "Reads the position once", .arguments = {kAfterArgument}}),
  };
  return kOperations;
}

// The other encoders of the bus would execute a request to all of them, or would not follow a new rate.
bool Permits(const BusConfig& bus, const DeviceConfig&, std::string_view operation) {
  return (operation != kSetBaudName && operation != kQueryAddressName) || bus.devices.size() <= 1;
}

bool LooksElsewhere(const DriverCommand& command) {
  return command.operation == kQueryAddressName || FindArgument(command.arguments, "from") ||
         FindArgument(command.arguments, "after");
}

bool Writes(std::string_view operation) {
  const OperationSpec* spec = FindOperation(Operations(), operation);
  return spec != nullptr && spec->writes != nullptr;
}

Made MakeProcedure(const DriverCommand& command, const OperationContext& context) {
  if (command.operation == kZeroName) return MakeDatumWrite(Parameter::kZero, context);
  if (command.operation == kSetDirectionName) return MakeDirection(command, context);
  if (command.operation == kSetBaudName) return MakeSetBaud(command, context);
  if (command.operation == kSetAddressName) return MakeSetAddress(command, context);
  if (command.operation == kQueryAddressName) return MakeQuery(context);
  if (command.operation != kReadPositionName) return UnknownOperation("saa_modbus", command.operation);
  if (const auto after = FindArgument(command.arguments, "after")) return MakeLook(std::string(*after), context);
  return MakeReadPosition(std::nullopt, context);
}

}  // namespace axlecast::saa_modbus
