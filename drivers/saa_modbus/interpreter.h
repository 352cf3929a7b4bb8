#pragma once

#include <cstdint>
#include <optional>

#include "core/device/device.h"
#include "drivers/saa_modbus/answer.h"
#include "drivers/saa_modbus/procedure.h"
#include "drivers/saa_modbus/settings.h"

namespace axlecast::saa_modbus {

// What the encoder says, towards the outside: samples, errors by kind, writes of its memory, and where its position
// jumps because of a setting. All of it follows from the events alone, so a recorded sequence gives the same again.
class Interpreter {
 public:
  // Follows the encoder to the address that it was given: `connection` is changed then.
  // `wire` has no baud where the line is simulated.
  Interpreter(const SaaModbusSettings& settings, const LineFormat& wire, Connection& connection,
              DeviceOutput& output)
      : settings_(settings), wire_(wire), connection_(connection), output_(output) {}

  // An exchange is over: kReply or kTimeout.
  Answer OnExchange(const Event& event);
  // The link went while this request was under way.
  void OnLost(Bytes request);
  void OnLinkDown();

  // Good replies come: the last exchanges were not all silent.
  [[nodiscard]] bool answering() const { return answering_; }

 private:
  void OnWrite(const Request& asked);
  void OnPosition(const Answer& answer, const Event& event);

  // Exchanges in a row without an own reply, after which the encoder counts as gone.
  static constexpr int kGone = 2;

  const SaaModbusSettings& settings_;
  const LineFormat wire_;
  Connection& connection_;
  DeviceOutput& output_;
  bool answering_ = false;
  int silent_in_a_row_ = 0;
  std::optional<std::uint8_t> new_address_;  // was ordered; a reading from there shows that it was taken on
  bool datum_changing_ = false;
};

}  // namespace axlecast::saa_modbus
