#include "drivers/cia406/operations.h"

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/device/operation.h"
#include "drivers/cia406/cia406.h"
#include "drivers/cia406/procedures.h"
#include "drivers/kit/arguments.h"
#include "drivers/kit/command_runner.h"

namespace axlecast::cia406 {
namespace {

using Made = Result<std::unique_ptr<Procedure>>;

constexpr std::string_view kZero = "zero";
constexpr std::string_view kSetPosition = "set_position";
constexpr std::string_view kReadPosition = "read_position";
constexpr std::string_view kReadIdentity = "read_identity";
constexpr std::string_view kReadState = "read_state";
constexpr std::string_view kSave = "save_parameters";

constexpr MonoNs kPatience = 2 * kSecond;
constexpr int kMaxObjects = 5;  // of one readout

// Returns the preset value that an operation writes; nothing if it writes no preset, or if its counts are wrong.
std::optional<std::uint32_t> TargetOf(std::string_view operation, const Arguments& arguments,
                                      const Cia406Settings& settings) {
  if (operation == kZero) return 0;
  if (operation != kSetPosition) return std::nullopt;
  const std::int64_t maximum = (std::int64_t{1} << settings.total_bits()) - 1;
  const std::optional<std::int64_t> value = WholeArgument(arguments, "counts", 0, maximum);
  return value ? std::optional(static_cast<std::uint32_t>(*value)) : std::nullopt;
}

tl::unexpected<Error> BadCounts(const Cia406Settings& settings) {
  return BadArgument(Text("counts must be a whole number, 0 to 2^%d - 1 (6002h): turns and single-turn together",
                          settings.total_bits()));
}

Made MakePositionReadout(const DriverCommand& command, const Cia406Settings& settings, const DeviceOutput& output,
                         MonoNs deadline) {
  std::optional<std::uint32_t> target;
  if (const auto after = AfterArgument(command.arguments)) {
    target = TargetOf(after->operation, after->arguments, settings);
    if (!target) return BadArgument("after must be zero, or \"set_position counts=N\" with its counts");
  }
  return std::make_unique<PositionReadout>(target, settings, output, deadline);
}

}  // namespace

std::span<const OperationSpec> Operations() {
  static const std::vector<OperationSpec> kSpecs = {
      {.name = kZero,
       .help = "Makes the present shaft angle the encoder's 0, turns too: preset value 6003h",
       .arguments = {},
       .destructive = true,
       .needs_standstill = true,
       .needs_permit = true,
       .moves_datum = true,
       .writes = &OneWrite,  // some makers' encoders keep a preset at once
       .verification = "a reading shows 0 +- 0.2 degrees (or 2 counts), if it read otherwise before",
       .verified_by_operation = kReadPosition},
      {.name = kSetPosition,
       .help = "Makes the encoder read this position at the present shaft angle: preset value 6003h",
       .arguments = {{"counts", "turns and single-turn together, 0 to the total range - 1"}},
       .destructive = true,
       .needs_standstill = true,
       .needs_permit = true,
       .moves_datum = true,
       .writes = &OneWrite,
       .verification = "a reading shows it, +- 0.2 degrees (or 2 counts), if it read otherwise before",
       .verified_by_operation = kReadPosition},
      {.name = kReadPosition,
       .help = "Reads the position once",
       .arguments = {{"after", "an operation, to see whether it took effect: zero, set_position counts=N", false}},
       .reads_only = true,
       .verification = "the reading itself"},
      {.name = kReadIdentity,
       .help = "Reads device type, vendor, product, revision and serial number (1000h, 1018h)",
       .reads_only = true,
       .verification = "the reading itself"},
      {.name = kReadState,
       .help = "Shows NMT state, error register, operating status, alarms, warnings and the last emergency message",
       .reads_only = true,
       .verification = "the reading itself"},
      {.name = kSave,
       .help = "Has the encoder store its parameters, a preset among them (1010h sub 1)",
       .arguments = {},
       .destructive = true,
       .writes = &OneWrite,
       .verification = "the encoder's confirmation"},
  };
  return kSpecs;
}

Made MakeProcedure(const DriverCommand& command, const Cia406Settings& settings, const Interpreter& interpreter,
                   const DeviceOutput& output, MonoNs now) {
  const MonoNs deadline = now + kPatience + kMaxObjects * settings.sdo_timeout;
  if (command.operation == kZero || command.operation == kSetPosition) {
    const auto target = TargetOf(command.operation, command.arguments, settings);
    if (!target) return BadCounts(settings);
    return std::make_unique<PresetProcedure>(*target, settings, output, now);
  }
  if (command.operation == kReadPosition) return MakePositionReadout(command, settings, output, deadline);
  if (command.operation == kReadIdentity) return std::make_unique<IdentityReadout>(deadline);
  if (command.operation == kReadState) return std::make_unique<StateReadout>(interpreter, deadline);
  if (command.operation == kSave) return std::make_unique<SaveProcedure>(settings, now);
  return UnknownOperation("model cia406", command.operation);
}

}  // namespace axlecast::cia406
