#include <algorithm>
#include <bit>
#include <memory>

#include "core/device/operation.h"
#include "drivers/kit/asking_probe.h"
#include "drivers/protocol/modbus/adu.h"
#include "drivers/saa_modbus/family.h"
#include "drivers/saa_modbus/interpreter.h"

namespace axlecast::saa_modbus {
namespace {

constexpr MonoNs kPatience = 30 * kMillisecond;  // in addition to the wire: the encoder, and an adapter's 16 ms
constexpr int kConfirmations = 2;
constexpr std::size_t kThreeByteReply = 8;  // with 17 to 24 bits of position
constexpr int kAttempts = 2;                // of a request whose reply is damaged
// A bus rarely has more devices, and these addresses are tried at every rate before the others.
constexpr int kUsualAddresses = static_cast<int>(kMaxDevices);

AskingProbe::Question QuestionOf(const Frame& request, axlecast::ReplyLength length, const LineFormat& line) {
  AskingProbe::Question question{
      .exchange = {.request = request, .reply_length = length, .timeout = LongestExchange(line) + kPatience},
      .quiet = 2 * SilentInterval(line)};
  question.exchange.shape = length == &modbus::ReplyLength ? modbus::ShapeOf(request) : ReplyShapeOf(request);
  return question;
}

// Requests the position at one address after the other: one register, which encoders of up to 16 bits answer, then two,
// which the others answer. An answer is confirmed twice. Then an input register is requested: every SAA encoder leaves
// that unanswered, and another Modbus device refuses it at least. Functions 03 and 04 only: nothing is ever written.
class SaaModbusProbe final : public AskingProbe {
 public:
  // Addresses `first` to `last`, both included.
  SaaModbusProbe(const LineFormat& line, int first, int last)
      : line_(line), first_(first), last_(last), address_(first) {}

  [[nodiscard]] std::vector<ProbeHit> Findings() const override { return findings_; }
  [[nodiscard]] double Progress() const override {
    return static_cast<double>(address_ - first_) / static_cast<double>(last_ - first_ + 1);
  }

 protected:
  [[nodiscard]] std::optional<Question> Ask() const override {
    if (address_ > last_) return std::nullopt;
    const auto address = static_cast<std::uint8_t>(address_);
    if (stage_ == Stage::kInputRegister) {
      return QuestionOf(modbus::Read(address, modbus::Function::kReadInputRegisters, 0, 1), &modbus::ReplyLength,
                        line_);
    }
    const int registers = stage_ == Stage::kConfirm ? registers_ : stage_ == Stage::kOneRegister ? 1 : 2;
    return QuestionOf(ReadRequest(address, registers), &ReplyLength, line_);
  }

  void Evaluate(const Event& event) override {
    ++tries_;
    if (stage_ == Stage::kInputRegister) return OnInputRegister(event);
    OnPosition(event);
  }

 private:
  enum class Stage : std::uint8_t { kOneRegister, kTwoRegisters, kConfirm, kInputRegister };

  void OnPosition(const Event& event) {
    const Answer answer = Interpret(event, event.bytes.size() == kThreeByteReply ? 24 : kMaxBits);
    if (answer.error == ErrorKind::kException) {
      return AddOther("it refuses to give its position, and SAA encoders refuse nothing");
    }
    if (!answer.ok()) {
      if (!event.bytes.empty() && tries_ < kAttempts) return;
      if (stage_ == Stage::kConfirm) return Enter(Stage::kInputRegister);
      return stage_ == Stage::kOneRegister ? Enter(Stage::kTwoRegisters) : NextAddress();
    }
    positions_ |= answer.reply.counts;
    reply_size_ = event.bytes.size();
    if (stage_ != Stage::kConfirm) {
      registers_ = stage_ == Stage::kOneRegister ? 1 : 2;
      return Enter(Stage::kConfirm);
    }
    if (++confirmed_ == kConfirmations) Enter(Stage::kInputRegister);
  }

  void OnInputRegister(const Event& event) {
    const modbus::Reply reply = modbus::Check(event.request, event.bytes);
    if (reply.ok() || reply.error == ErrorKind::kException) {
      return AddOther("it knows function 04, which SAA encoders have not");
    }
    AddEncoder();
    NextAddress();
  }

  void AddEncoder() {
    const int maximum = registers_ == 1 ? kOneRegisterBits : reply_size_ == kThreeByteReply ? 24 : kMaxBits;
    const int minimum =
        std::max({registers_ == 1 ? kMinBits : kOneRegisterBits + 1, static_cast<int>(std::bit_width(positions_))});
    ProbeHit hit;
    hit.confidence = confirmed_ == kConfirmations ? Confidence::kLikely : Confidence::kPossible;
    hit.device = Text("SAA encoder on Modbus, address %d", address_);
    hit.reason = Text(
        "answered %d of 3 reads of its position in %d register%s with the right CRC, and no read of input "
        "registers",
        confirmed_ + 1, registers_, registers_ == 1 ? "" : "s");
    hit.keys = {{"bits", std::to_string(maximum)}, {"address", std::to_string(address_)}};
    hit.check = Text("bits: %d to %d by its answers; see the encoder's label", minimum, maximum);
    findings_.push_back(std::move(hit));
  }

  void AddOther(const char* reason) {
    ProbeHit hit;
    hit.confidence = Confidence::kSure;
    hit.device = Text("another Modbus device, address %d", address_);
    hit.reason = reason;
    findings_.push_back(std::move(hit));
    NextAddress();
  }

  void Enter(Stage stage) {
    stage_ = stage;
    tries_ = 0;
  }

  void NextAddress() {
    ++address_;
    confirmed_ = 0;
    positions_ = 0;
    Enter(Stage::kOneRegister);
  }

  LineFormat line_;
  int first_;
  int last_;
  int address_;
  Stage stage_ = Stage::kOneRegister;
  int registers_ = 1;  // that it answers
  int tries_ = 0;      // in this stage
  int confirmed_ = 0;
  std::uint32_t positions_ = 0;  // every bit that was ever set
  std::size_t reply_size_ = 0;   // bytes of its last answer
  std::vector<ProbeHit> findings_;
};

void AddTrials(const ProbeScope& scope, int first, int last, std::vector<ProbeTrial>& trials) {
  first = std::max(first, scope.first_address);
  last = std::min(last, scope.last_address);
  if (first > last) return;
  std::vector<std::int64_t> rates = scope.RatesOf({BaudRates().begin(), BaudRates().end()});
  const auto delivered = [](std::int64_t rate) { return rate == 19'200; };
  std::stable_partition(rates.begin(), rates.end(), delivered);
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
}  // namespace axlecast::saa_modbus

namespace axlecast {

std::vector<ProbeTrial> saa_modbus_probe(const ProbeScope& scope) {
  std::vector<ProbeTrial> trials;
  saa_modbus::AddTrials(scope, saa_modbus::kMinAddress, saa_modbus::kUsualAddresses, trials);
  saa_modbus::AddTrials(scope, saa_modbus::kUsualAddresses + 1, saa_modbus::kMaxAddress, trials);
  return trials;
}

}  // namespace axlecast
