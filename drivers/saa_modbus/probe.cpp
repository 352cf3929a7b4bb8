#include "drivers/saa_modbus/probe.h"

#include <algorithm>
#include <bit>
#include <memory>

#include "core/device/operation.h"
#include "drivers/protocol/modbus/adu.h"
#include "drivers/saa_modbus/procedures.h"
#include "drivers/saa_modbus/settings.h"

namespace axlecast::saa_modbus {
namespace {

constexpr MonoNs kPatience = 30 * kMillisecond;  // beyond the wire: the encoder, and an adapter's 16 ms
constexpr int kConfirmations = 2;
constexpr std::size_t kThreeByteReply = 8;  // with 17 to 24 bits of position
constexpr int kAttempts = 2;                // of a question whose answer came damaged
// A bus is rarely fuller, and these addresses are asked at every rate before the others.
constexpr int kUsualAddresses = static_cast<int>(kMaxDevices);

AskingProbe::Question QuestionOf(const Frame& request, axlecast::ReplyLength length, const LineFormat& line) {
  AskingProbe::Question question{
      .exchange = {.request = request, .reply_length = length, .timeout = LongestExchange(line) + kPatience},
      .quiet = 2 * SilentInterval(line)};
  question.exchange.shape = length == &modbus::ReplyLength ? modbus::ShapeOf(request) : ReplyShapeOf(request);
  return question;
}

void AddTrials(const ProbeScope& scope, int first, int last, std::vector<ProbeTrial>& trials) {
  first = std::max(first, scope.first_address);
  last = std::min(last, scope.last_address);
  if (first > last) return;
  std::vector<std::int64_t> rates = scope.RatesOf({BaudRates().begin(), BaudRates().end()});
  std::stable_partition(rates.begin(), rates.end(),
                        [](std::int64_t rate) { return rate == 19'200; });  // as delivered
  for (const std::int64_t baud : rates) {
    const LineFormat line = {.baud = baud};
    const AskingProbe::Question question = QuestionOf(ReadRequest(1, 1), &ReplyLength, line);
    ProbeTrial trial;
    trial.what = Text("Modbus RTU, function 03, addresses %d to %d", first, last);
    trial.asks = true;
    trial.line = line;
    trial.longest = 2 * (last - first + 1) * (line.WireTime(8) + question.exchange.timeout + question.quiet);
    trial.make = [line, first, last](MonoNs) { return std::make_unique<SaaModbusProbe>(line, first, last); };
    trials.push_back(std::move(trial));
  }
}

}  // namespace

Frame SaaModbusProbe::Request() const {
  const auto address = static_cast<std::uint8_t>(address_);
  switch (stage_) {
    case Stage::kOneRegister:
      return ReadRequest(address, 1);
    case Stage::kTwoRegisters:
      return ReadRequest(address, 2);
    case Stage::kConfirm:
      return ReadRequest(address, registers_);
    case Stage::kForeign:
      break;
  }
  return modbus::Read(address, modbus::Function::kReadInputRegisters, 0, 1);
}

std::optional<AskingProbe::Question> SaaModbusProbe::Ask() const {
  if (address_ > last_) return std::nullopt;
  return QuestionOf(Request(), stage_ == Stage::kForeign ? &modbus::ReplyLength : &ReplyLength, line_);
}

void SaaModbusProbe::Judge(const Event& event) {
  ++tries_;
  if (stage_ == Stage::kForeign) return JudgeForeign(event);
  JudgePosition(event);
}

void SaaModbusProbe::JudgePosition(const Event& event) {
  const Answer answer = Interpret(event, event.bytes.size() == kThreeByteReply ? 24 : kMaxBits);
  if (answer.error == ErrorKind::kException) {
    AddStranger("it refuses to give its position, and SAA encoders refuse nothing");
    return NextAddress();
  }
  if (!answer.ok()) {
    if (!event.bytes.empty() && tries_ < kAttempts) return;
    if (stage_ == Stage::kConfirm) return Go(Stage::kForeign);
    return stage_ == Stage::kOneRegister ? Go(Stage::kTwoRegisters) : NextAddress();
  }
  positions_ |= answer.reply.counts;
  reply_size_ = event.bytes.size();
  if (stage_ != Stage::kConfirm) {
    registers_ = stage_ == Stage::kOneRegister ? 1 : 2;
    return Go(Stage::kConfirm);
  }
  if (++confirmed_ == kConfirmations) Go(Stage::kForeign);
}

void SaaModbusProbe::JudgeForeign(const Event& event) {
  const modbus::Reply reply = modbus::Check(event.request, event.bytes);
  if (reply.ok() || reply.error == ErrorKind::kException) {
    AddStranger("it knows function 04, which SAA encoders have not");
  } else {
    AddEncoder();
  }
  NextAddress();
}

void SaaModbusProbe::AddEncoder() {
  const int maximum = registers_ == 1 ? kOneRegisterBits : reply_size_ == kThreeByteReply ? 24 : kMaxBits;
  const int minimum =
      std::max({registers_ == 1 ? kMinBits : kOneRegisterBits + 1, static_cast<int>(std::bit_width(positions_))});
  ProbeHit finding;
  finding.confidence = confirmed_ == kConfirmations ? Confidence::kLikely : Confidence::kPossible;
  finding.device = Text("SAA encoder on Modbus, address %d", address_);
  finding.reason = Text(
      "answered %d of 3 reads of its position in %d register%s with the right CRC, and no read of input registers",
      confirmed_ + 1, registers_, registers_ == 1 ? "" : "s");
  finding.keys = {{"bits", std::to_string(maximum)}, {"address", std::to_string(address_)}};
  finding.check = Text("bits: %d to %d by its answers; the encoder's label says which", minimum, maximum);
  findings_.push_back(std::move(finding));
}

void SaaModbusProbe::AddStranger(const char* why) {
  findings_.push_back({.confidence = Confidence::kSure,
                       .device = Text("another Modbus device, address %d", address_),
                       .reason = why,
                       .bus = {},
                       .keys = {},
                       .check = {}});
}

void SaaModbusProbe::Go(Stage stage) {
  stage_ = stage;
  tries_ = 0;
}

void SaaModbusProbe::NextAddress() {
  ++address_;
  confirmed_ = 0;
  positions_ = 0;
  Go(Stage::kOneRegister);
}

double SaaModbusProbe::Progress() const {
  return static_cast<double>(address_ - first_) / static_cast<double>(last_ - first_ + 1);
}

// ---- what is tried ----

namespace {

std::vector<ProbeTrial> ProbeTrials(const ProbeScope& scope) {
  std::vector<ProbeTrial> trials;
  AddTrials(scope, kMinAddress, kUsualAddresses, trials);
  AddTrials(scope, kUsualAddresses + 1, kMaxAddress, trials);
  return trials;
}

}  // namespace

}  // namespace axlecast::saa_modbus

namespace axlecast {

std::vector<ProbeTrial> saa_modbus_probe(const ProbeScope& scope) { return saa_modbus::ProbeTrials(scope); }

}  // namespace axlecast
