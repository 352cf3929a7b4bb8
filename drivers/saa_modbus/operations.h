#pragma once

#include <axlecast/command_status_t.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/result.h"
#include "core/device/device.h"
#include "core/device/operation.h"
#include "core/device/step.h"
#include "drivers/kit/command_runner.h"
#include "drivers/saa_modbus/codec.h"
#include "drivers/saa_modbus/interpreter.h"
#include "drivers/saa_modbus/settings.h"

namespace axlecast::saa_modbus {

// A reading of the position. The device decides how many registers it requests.
struct ReadAt {
  std::uint8_t address = 0;
};
// The next step of a procedure. A Frame is a request that is sent as it is.
using ProcedureStep = std::variant<Idle, ReadAt, Frame, SetBaudRate>;

// Maximum number of consecutive failures of the same request.
inline constexpr int kTries = 3;

// The steps of one command on this protocol.
class Procedure : public CommandProcedure {
 public:
  [[nodiscard]] virtual ProcedureStep Next(MonoNs now) const = 0;
  // Begins the exchange that Next returned. Returns the final outcome if this ends the procedure.
  virtual std::optional<Outcome> OnStarted([[maybe_unused]] Bytes request, [[maybe_unused]] MonoNs now) {
    return std::nullopt;
  }
  // Called with the answer of an exchange that ended at `end`. Returns progress, the final outcome, or nothing.
  virtual std::optional<Outcome> OnAnswer(const Answer& answer, MonoNs end) = 0;
  // The port now has the rate that Next returned.
  virtual void OnBaudRateSet([[maybe_unused]] MonoNs now) {}
  // The outcome of a procedure that only reads.
  [[nodiscard]] Outcome OnLinkLost() const override {
    return Final(CommandState::kFailed, command_status_t::REASON_NO_REPLY,
                 "the link was lost before the answer came");
  }
};

// The parts of the device and its bus that a procedure uses. They outlive the procedure.
struct OperationContext {
  const SaaModbusSettings& settings;
  const DeviceOutput& output;
  Connection& connection;
  const std::vector<std::uint8_t>& other_addresses;  // of the bus's other configured encoders
};

// Where an encoder answers.
struct Place {
  std::uint8_t address = 0;
  std::int64_t baud = 0;

  friend bool operator==(const Place&, const Place&) = default;
};

// ---- datum ----

// Sets the position to zero or sets the counting direction (`parameter`: CC 00, 01, 02).
[[nodiscard]] std::unique_ptr<Procedure> MakeDatumWrite(Parameter parameter, const OperationContext& context);
// Reads the position once. `after`: the datum write whose effect is verified, or nothing.
[[nodiscard]] std::unique_ptr<Procedure> MakeReadPosition(std::optional<Parameter> after,
                                                          const OperationContext& context);

// ---- connection ----

// What a ConnectionChange writes.
enum class ConnectionKey : std::uint8_t { kAddress, kBaud };

// Gives the encoder another address or baud rate. `from` and `to` differ in nothing else.
[[nodiscard]] std::unique_ptr<Procedure> MakeConnectionChange(ConnectionKey key, Place from, Place to,
                                                              Connection& connection);
// Checks whether the encoder answers at `changed` or at its present place, and follows it. `after`: the operation whose
// effect is verified, for the text.
[[nodiscard]] std::unique_ptr<Procedure> MakeFindEncoder(Place changed, std::string after,
                                                         const OperationContext& context);
// Queries the address of the only connected encoder (FF A0).
[[nodiscard]] std::unique_ptr<Procedure> MakeQueryAddress(const Connection& connection);

// ---- operations ----

[[nodiscard]] std::span<const OperationSpec> Operations();
// Returns whether the configuration of a device permits an operation of the family.
[[nodiscard]] bool Permits(const BusConfig& bus, const DeviceConfig& device, std::string_view operation);

// Returns whether the command may find the encoder at another address or baud rate than the file's: it is allowed even
// if the encoder does not answer.
[[nodiscard]] bool LooksElsewhere(const DriverCommand& command);
// Returns whether an operation writes the encoder's memory.
[[nodiscard]] bool Writes(std::string_view operation);

// Returns the procedure that carries out a command, or an error with a REASON_* if an argument is wrong or the bus
// forbids it.
[[nodiscard]] Result<std::unique_ptr<Procedure>> MakeProcedure(const DriverCommand& command,
                                                               const OperationContext& context);

// ---- shared by the procedures ----

// Counts a failed reading. Returns the final outcome after kTries of them.
[[nodiscard]] std::optional<Outcome> CountFailure(const Answer& answer, int& failures);
// Returns the position as a success: its text follows `text`, its counts are the change `single_turn`.
[[nodiscard]] Outcome PositionOutcome(const std::string& text, std::int64_t counts, int bits);

}  // namespace axlecast::saa_modbus
