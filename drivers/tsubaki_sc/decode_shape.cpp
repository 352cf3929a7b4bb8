#include "drivers/tsubaki_sc/decode_shape.h"

namespace axlecast::tsubaki_sc {
namespace {

using modbus::Function;
using Form = Shape::Form;

constexpr std::size_t kFixedSize = 8;  // of a read request, a single write, and the reply to a multiple write
constexpr std::size_t kErrorSize = 5;
constexpr std::size_t kReadOverhead = 5;  // address, function, byte count, CRC
constexpr std::size_t kBeforeData = 7;    // of a multiple write
constexpr std::size_t kCrc = 2;
constexpr std::size_t kVersionRequestSize = 4;
constexpr std::size_t kVersionReplySize = 6;  // guideline 12: without a byte count
constexpr std::uint8_t kErrorBit = 0x80;

Shape ReadShape(Bytes frame, const char* name) {
  const auto function = static_cast<Function>(frame[1]);
  const bool bits = function == Function::kReadCoils || function == Function::kReadDiscreteInputs;
  const std::size_t bytes = frame.size() > 2 ? frame[2] : 0;
  const bool reply = frame.size() != kFixedSize && (bits ? bytes == 1 : bytes > 0 && bytes % 2 == 0);
  if (reply) return {Form::kReadReply, std::string(name) + "_reply", kReadOverhead + bytes, function};
  return {Form::kReadRequest, std::string(name) + "_request", kFixedSize, function};
}

Shape MultipleShape(Bytes frame, const char* name, Function space) {
  if (frame.size() == kFixedSize) return {Form::kMultipleReply, std::string(name) + "_reply", kFixedSize, space};
  const std::size_t bytes = frame.size() < kBeforeData ? 1 : frame[kBeforeData - 1];
  return {Form::kMultipleWrite, std::string(name) + "_request", kBeforeData + bytes + kCrc, space};
}

}  // namespace

bool Shape::is_request() const { return is_write() || form == Form::kReadRequest || form == Form::kVersionRequest; }

bool Shape::is_bits() const { return space == Function::kReadCoils || space == Function::kReadDiscreteInputs; }

Shape ShapeOf(Bytes frame) {
  if ((frame[1] & kErrorBit) != 0) return {Form::kError, "error_reply", kErrorSize, {}};
  switch (static_cast<Function>(frame[1])) {
    case Function::kReadCoils:
      return ReadShape(frame, "read_coils");
    case Function::kReadDiscreteInputs:
      return ReadShape(frame, "read_input_status");
    case Function::kReadHoldingRegisters:
      return ReadShape(frame, "read_holding_registers");
    case Function::kReadInputRegisters:
      return ReadShape(frame, "read_input_registers");
    case Function::kWriteCoil:
      return {Form::kSingleWrite, "write_coil_request_or_reply", kFixedSize, Function::kReadCoils};
    case Function::kWriteRegister:
      return {Form::kSingleWrite, "write_register_request_or_reply", kFixedSize, Function::kReadHoldingRegisters};
    case Function::kWriteCoils:
      return MultipleShape(frame, "write_coils", Function::kReadCoils);
    case Function::kWriteRegisters:
      return MultipleShape(frame, "write_registers", Function::kReadHoldingRegisters);
    case Function::kReportServerId:
      if (frame.size() <= kVersionRequestSize) {
        return {Form::kVersionRequest, "report_slave_id_request", kVersionRequestSize, {}};
      }
      return {Form::kVersionReply, "report_slave_id_reply", kVersionReplySize, {}};
  }
  return {};
}

}  // namespace axlecast::tsubaki_sc
