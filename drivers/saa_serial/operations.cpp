#include "drivers/saa_serial/operations.h"

#include <algorithm>
#include <vector>

#include "core/config/machine_config.h"
#include "core/device/operation.h"
#include "drivers/kit/arguments.h"
#include "drivers/saa_serial/position_readout.h"
#include "drivers/saa_serial/zero_procedure.h"

namespace axlecast::saa_serial {
namespace {

// For a reading: several periods of a slow stream, or several requests in vain.
constexpr MonoNs kPatience = 2 * kSecond;
constexpr int kPatiencePeriods = 20;

}  // namespace

std::span<const OperationSpec> Operations() {
  static const std::vector<OperationSpec> kSpecs = {
      {.name = kZeroName,
       .help = "Makes the present shaft angle the encoder's 0: a pulse on CLR, or BC AA CX on a polled bus",
       .arguments = {},
       .destructive = true,
       .needs_standstill = true,
       .needs_permit = true,
       .moves_datum = true,
       .writes = &OneWrite,  // taken for one: the manual does not say where the zero is kept
       .verification =
           "two readings in a row show 0 +- 0.2 degrees (or 2 counts), if the shaft stood elsewhere before",
       .verified_by_operation = kReadPositionName},
      {.name = kReadPositionName,
       .help = "Reads the single-turn position once",
       .arguments = {{"after", "an operation, to see whether it took effect: zero", false}},
       .reads_only = true,
       .verification = "the reading itself"},
  };
  return kSpecs;
}

bool Permits(const BusConfig& bus, const DeviceConfig&, std::string_view operation) {
  return operation != kZeroName || static_cast<const SaaBus&>(*bus.family_bus).zero_clearing;
}

Result<std::unique_ptr<Procedure>> MakeProcedure(const DriverCommand& command, const SaaBus& bus,
                                                 const SaaSettings& settings, const DeviceOutput& output,
                                                 MonoNs now) {
  const MonoNs patience = std::max(kPatience, kPatiencePeriods * bus.refresh);
  if (command.operation == kZeroName) {
    if (bus.zero_clearing) return std::make_unique<ZeroProcedure>(settings, output, patience, now);
    return NotPermitted(
        bus.mode == Mode::kBus
            ? "the bus is configured without zero clearing; if the encoders have it, set zero_clearing: true"
            : "the bus has no CLR line in its configuration; if the encoder has one, name it: lines: {clr: {chip, "
              "line}}");
  }
  if (command.operation != kReadPositionName) return UnknownOperation("saa_serial", command.operation);
  const std::optional<std::string_view> after = FindArgument(command.arguments, "after");
  if (after && after != kZeroName) return BadArgument("after must be zero");
  return std::make_unique<PositionReadout>(after.has_value(), settings, output, patience, now);
}

}  // namespace axlecast::saa_serial
