// Any reply to any request, whole or late, through everything that reads it: nothing crashes, what is published comes
// from an undamaged reply of this unit, and what is decoded from it is its content.
#include <fuzzer/FuzzedDataProvider.h>

#include <cmath>
#include <cstdlib>
#include <vector>

#include "core/device/device.h"
#include "drivers/tsubaki_sc/interpreter.h"
#include "drivers/tsubaki_sc/register_map.h"
#include "drivers/tsubaki_sc/requests.h"

namespace axlecast::tsubaki_sc {
namespace {

void Require(bool holds) {
  if (!holds) std::abort();
}

class CheckedOutput final : public DeviceOutput {
 public:
  void OnSample(const Sample&) override { std::abort(); }
  void OnMotor(const MotorReading& reading) override {
    Require(readable);
    Require(reading.has_analog() || reading.has_status());
    Require(reading.mains_hz == 0 || reading.mains_hz == 50 || reading.mains_hz == 60);
    if (reading.has_analog()) Require(std::abs(reading.temperature_c) <= 3276.8F && reading.voltage_v >= 0);
  }
  void OnTrip(const TripRecord& trip) override {
    Require(readable);
    Require(trip.log_index >= 1 && trip.log_index <= 3 && trip.valid_mask != 0 && trip.valid_mask <= 0x7F);
    for (std::size_t q = 0; q < kQuantities; ++q) {
      Require(std::isnan(trip.samples[q][0]) == ((trip.valid_mask >> q & 1U) == 0));
    }
  }
  void OnError(ErrorKind, Interval) override {}
  void OnAlarm(const AlarmSpec&, AlarmState, MonoNs) override { Require(readable); }
  void OnIdentity(std::int64_t, std::string_view, std::string_view) override { Require(readable); }
  void OnStarting(std::string_view) override {}
  void OnRefused(std::string_view) override {}
  void OnNonVolatileWrite() override {}
  void OnReferenceLost() override {}
  void OnReferenceRestored() override {}
  void OnJump() override {}
  void OnDatumChanging(bool) override {}
  void OnOutcome(const CommandId&, const Outcome&) override {}
  [[nodiscard]] Motion MotionAt(MonoNs) const override { return {}; }

  bool readable = false;  // an intact reply of this unit has come
};

constexpr std::uint8_t kAddress = 3;
const std::array<Block, 12> kBlocks = {kStopCoil,  kMains,       kSetValues,   kAnalog,
                                       kStatus,    kLoginStatus, kLogInterval, kPassword,
                                       kMfgNumber, kProductCode, kVersion,     kParameterBlocks[2]};

Exchange ChooseRequest(FuzzedDataProvider& input, const Requests& requests, const TripReader& trips) {
  const auto choice = input.ConsumeIntegralInRange<std::size_t>(0, kBlocks.size() + 2);
  if (choice < kBlocks.size()) return requests.Read(kBlocks[choice]);
  if (choice == kBlocks.size()) return requests.SetCoil(kStopCoilAddress);
  if (choice == kBlocks.size() + 1 || !trips.pending()) {
    return requests.Read(
        LogBlock(input.ConsumeIntegralInRange<std::size_t>(0, 2), input.ConsumeIntegralInRange<std::size_t>(0, 6)));
  }
  return requests.Read(trips.Next());
}

// A possible reply of the unit: corrected so that it fits, or as it is.
std::vector<std::uint8_t> ChooseReply(FuzzedDataProvider& input, Bytes request) {
  auto reply = input.ConsumeBytes<std::uint8_t>(input.ConsumeIntegralInRange<std::size_t>(0, 60));
  const auto mend = input.ConsumeIntegralInRange(0, 2);
  if (mend == 2 && reply.size() > 3) {
    reply[0] = request[0];
    reply[1] = request[1];
    reply[2] = static_cast<std::uint8_t>(reply.size() - 3);
  }
  if (mend > 0) {
    const std::uint16_t crc = modbus::Crc16(reply);
    reply.push_back(static_cast<std::uint8_t>(crc));
    reply.push_back(static_cast<std::uint8_t>(crc >> 8U));
  }
  return reply;
}

void CheckAnswer(const Answer& answer, Bytes reply) {
  Require(answer.at.first <= answer.at.last);
  Require(!CauseOf(answer).empty());
  if (!answer.ok() && !answer.refused()) return;
  Require(modbus::IsSealed(reply) && reply[0] == kAddress);
  if (answer.refused()) {
    Require(reply.size() == 5);
    return;
  }
  if (!answer.block || *answer.block == kVersion) return;
  const bool bits = answer.block->read == modbus::Function::kReadCoils ||
                    answer.block->read == modbus::Function::kReadDiscreteInputs;
  Require(answer.reply.data.size() == (bits ? 1U : 2U * answer.block->count));
}

}  // namespace
}  // namespace axlecast::tsubaki_sc

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace axlecast;
  using namespace axlecast::tsubaki_sc;
  FuzzedDataProvider input(data, size);
  const Requests requests(kAddress, 150 * kMillisecond);
  const CharacterOrder order = input.ConsumeBool() ? CharacterOrder::kHighFirst : CharacterOrder::kLowFirst;
  CheckedOutput output;
  Interpreter interpreter(order, output);
  MonoNs now = 1'000 * kSecond;
  while (input.remaining_bytes() > 0) {
    const Exchange exchange = ChooseRequest(input, requests, interpreter.trips());
    const std::vector<std::uint8_t> reply = ChooseReply(input, exchange.request);
    const std::size_t length = exchange.reply_length(reply);
    Require(length <= kMaxFrame);
    const Event event{.kind = input.ConsumeBool() ? Event::Kind::kReply : Event::Kind::kTimeout,
                      .sent = {now, now + input.ConsumeIntegral<std::uint16_t>()},
                      .received = {now, now + input.ConsumeIntegral<std::uint16_t>()},
                      .request = exchange.request,
                      .bytes = reply};
    const Answer answer = Interpret(event, input.ConsumeBool() ? kMillisecond : 0);
    CheckAnswer(answer, reply);
    output.readable = output.readable || answer.ok();
    interpreter.OnAnswer(answer);
    if (!answer.ok()) interpreter.trips().OnFailure(answer);
    if (input.ConsumeBool()) interpreter.trips().RequestAll();
    if (input.ConsumeBool()) interpreter.Forget();
    static_cast<void>(HoldsPassword(reply, "password", order));
    now += kSecond;
  }
  return 0;
}
