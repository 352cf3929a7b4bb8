#include "drivers/saa_modbus/operations.h"

#include <algorithm>

#include "core/config/machine_config.h"
#include "core/device/operation.h"
#include "drivers/kit/arguments.h"
#include "drivers/kit/command_runner.h"
#include "drivers/saa_modbus/connection_procedures.h"
#include "drivers/saa_modbus/procedures.h"

namespace axlecast::saa_modbus {
namespace {

using Made = Result<std::unique_ptr<Procedure>>;

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
       .arguments = {kAfterArgument},
       .reads_only = true,
       .verification = "it is a reading"},
  };
  return kSpecs;
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

bool Others(const OperationContext& context, std::uint8_t address) {
  return std::find(context.other_addresses.begin(), context.other_addresses.end(), address) !=
         context.other_addresses.end();
}

constexpr const char* kBadAddress = "address and from must be 1 to 247";
constexpr const char* kBadBaud = "baud must be 2400, 4800, 9600, 19200 or 57600";

Made MakeDirection(const DriverCommand& command, const OperationContext& context) {
  const std::optional<Parameter> direction = DirectionOf(command.arguments);
  if (!direction) return BadArgument("direction must be positive or negative");
  return std::make_unique<DatumWrite>(*direction, context.settings, context.connection, context.output);
}

Made MakeSetBaud(const DriverCommand& command, const OperationContext& context) {
  const std::optional<std::int64_t> baud = BaudArgument(command.arguments);
  if (!baud) return BadArgument(kBadBaud);
  if (!context.other_addresses.empty()) {
    return NotPermitted(
        "the bus has other encoders, which would not follow: connect this one alone, and give it a "
        "bus of its own in the file");
  }
  return std::make_unique<SetBaud>(*baud, context.connection);
}

Made MakeSetAddress(const DriverCommand& command, const OperationContext& context) {
  const auto to = AddressOf(command.arguments, "address", 0);
  const auto from = AddressOf(command.arguments, "from", context.connection.address);
  if (!to || *to == 0 || !from) return BadArgument(kBadAddress);
  if (Others(context, *to)) return NotPermitted(Text("address %d is another encoder's of this bus", int{*to}));
  if (Others(context, *from)) {
    return NotPermitted(
        Text("address %d is another encoder's of this bus: give the command to that device", int{*from}));
  }
  return std::make_unique<SetAddress>(*from, *to, context.connection);
}

Made MakeQuery(const OperationContext& context) {
  if (!context.other_addresses.empty()) {
    return NotPermitted(
        "the question goes to every encoder on the bus, and all would answer at once: connect this "
        "one alone, and give it a bus of its own in the file");
  }
  return std::make_unique<AskAddress>(context.connection);
}

// Looks whether the operation that `after` names took effect.
Made MakeLook(const std::string& text, const OperationContext& context) {
  const CommandLine after = ParseCommandLine(text);
  const auto read = [&](Parameter parameter) -> Made {
    return std::make_unique<ReadPosition>(parameter, context.settings, context.connection, context.output);
  };
  const auto find = [&](Search::Place place) -> Made {
    return std::make_unique<FindEncoder>(place, text, context.settings, context.connection);
  };
  if (after.operation == kZero) return read(Parameter::kZero);
  if (after.operation == kSetDirection) {
    const std::optional<Parameter> direction = DirectionOf(after.arguments);
    if (!direction) return BadArgument("after names a direction: positive or negative");
    return read(*direction);
  }
  if (after.operation == kNewAddress) {
    const auto to = AddressOf(after.arguments, "address", 0);
    if (!to || *to == 0 || Others(context, *to))
      return BadArgument("after names an address: 1 to 247, of no other");
    return find({*to, context.connection.baud});
  }
  if (after.operation == kSetBaudRate) {
    const std::optional<std::int64_t> baud = BaudArgument(after.arguments);
    if (!baud || !context.other_addresses.empty())
      return BadArgument("after names a rate, of an encoder that is alone");
    return find({context.connection.address, *baud});
  }
  return BadArgument("after must be zero, set_direction, set_address or set_baud with its arguments");
}

}  // namespace

std::span<const OperationSpec> Operations() { return Specs(); }

// The other encoders of the bus would take what is sent to all of them, or would not follow a new rate.
bool Permits(const BusConfig& bus, const DeviceConfig&, std::string_view operation) {
  return (operation != kSetBaudRate && operation != kAskForAddress) || bus.devices.size() <= 1;
}

bool LooksElsewhere(const DriverCommand& command) {
  return command.operation == kAskForAddress || FindArgument(command.arguments, "from") ||
         FindArgument(command.arguments, "after");
}

bool Writes(std::string_view operation) {
  const OperationSpec* spec = FindOperation(Operations(), operation);
  return spec != nullptr && spec->writes != nullptr;
}

Made MakeProcedure(const DriverCommand& command, const OperationContext& context) {
  if (command.operation == kZero) {
    return std::make_unique<DatumWrite>(Parameter::kZero, context.settings, context.connection, context.output);
  }
  if (command.operation == kSetDirection) return MakeDirection(command, context);
  if (command.operation == kSetBaudRate) return MakeSetBaud(command, context);
  if (command.operation == kNewAddress) return MakeSetAddress(command, context);
  if (command.operation == kAskForAddress) return MakeQuery(context);
  if (command.operation != kRead) return UnknownOperation("saa_modbus", command.operation);
  if (const auto after = FindArgument(command.arguments, "after")) return MakeLook(std::string(*after), context);
  return std::make_unique<ReadPosition>(std::nullopt, context.settings, context.connection, context.output);
}

}  // namespace axlecast::saa_modbus
