#include "drivers/saa_serial/family.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/device/operation.h"
#include "drivers/kit/asking_probe.h"
#include "drivers/kit/listening_probe.h"
#include "drivers/saa_serial/stream_parser.h"

namespace axlecast::saa_serial {
namespace {

constexpr MonoNs kListen = kSecond;              // ten frames of the slowest stream that is found
constexpr MonoNs kSettle = 200 * kMillisecond;   // what the port had kept back comes faster than it was sent
constexpr MonoNs kPatience = 30 * kMillisecond;  // of a reply, beyond the wire: an adapter's 16 ms
constexpr MonoNs kQuiet = 10 * kMillisecond;
constexpr int kAttempts = 3;
constexpr std::int64_t kMinFrames = 3;
constexpr std::int64_t kManyFrames = 10;
constexpr int kLastX = 15;

// The manual gives none: the maker sets the rate to order.
const std::vector<std::int64_t> kUsualRates = {115'200, 9'600,   19'200,    38'400,    57'600,    230'400, 460'800,
                                               921'600, 500'000, 1'000'000, 2'000'000, 2'500'000, 4'800,   2'400};

// The resolutions whose frames have as many data bytes as those of `most`.
std::string BitsText(int maximum, std::uint32_t positions) {
  const int minimum = maximum == 16 ? kMinBits : maximum == 24 ? 17 : 25;
  return Text("bits: %d to %d by its frames; the encoder's label states which",
              std::max(minimum, static_cast<int>(std::bit_width(positions))), maximum);
}

// In the form of the purchase order: two digits if they are within the error of the measurement, else three.
std::string RateText(double hz) {
  constexpr double kError = 0.02;
  const double round = std::stod(Text("%.2g", hz));
  return Text("%.10g", std::abs(round - hz) <= kError * hz ? round : std::stod(Text("%.3g", hz)));
}

// The whole answer is looked at, whatever its length.
std::size_t UntilTimeout(Bytes) { return 0; }

int BitsOfSize(std::size_t size) {
  for (const int bits : {16, 24, kMaxBits}) {
    if (ReplySize(bits) == size) return bits;
  }
  return 0;
}

// A line that changes its direction may bring bytes before the frame.
Bytes FromStart(Bytes bytes) {
  const auto start = std::find(bytes.begin(), bytes.end(), kFrameStart);
  return bytes.subspan(static_cast<std::size_t>(start - bytes.begin()));
}

Reply ParseAnyFrame(Bytes frame, int bits, std::uint8_t command) {
  return ParseReply(frame, {.bits = bits, .header = ReplyHeader::kEither, .address = command});
}

// The reply of an encoder whose resolution is not known: a frame of any length.
ReplyMatch MatchAnyFrame(Bytes request, Bytes reply) {
  const Bytes frame = FromStart(reply);
  const int bits = BitsOfSize(frame.size());
  if (bits == 0) return ReplyMatch::kNo;
  switch (ParseAnyFrame(frame, bits, ParseRequest(request).value_or(kFixedHeader)).error) {
    case ReplyError::kNone:
    case ReplyError::kRange:
      return ReplyMatch::kYes;
    case ReplyError::kHeader:
      return ReplyMatch::kNo;
    default:
      return ReplyMatch::kDamaged;
  }
}

// ---- streams ----

// Listens for an encoder that sends by itself; transmits nothing.
class StreamProbe final : public ListeningProbe {
 public:
  explicit StreamProbe(MonoNs now)
      : ListeningProbe(now, kListen), readings_{Reading(16), Reading(24), Reading(kMaxBits)} {}

  [[nodiscard]] std::vector<ProbeHit> Findings() const override {
    std::vector<ProbeHit> findings;
    for (const Reading& reading : readings_) {
      if (std::optional<ProbeHit> finding = Judge(reading)) findings.push_back(std::move(*finding));
    }
    return findings.size() == 1 ? findings : std::vector<ProbeHit>();  // one line has one encoder that streams
  }

 private:
  // What the bytes are when frames have this many data bytes.
  struct Reading {
    explicit Reading(int most_bits) : bits(most_bits), parser(most_bits) {}

    int bits;
    StreamParser parser;
    std::int64_t frames = 0;
    std::uint32_t positions = 0;  // every bit that was ever set
    std::optional<StreamParser::Found> first;
    std::optional<StreamParser::Found> last;
  };

  void Take(const Event& event) override {
    if (event.kind != Event::Kind::kUnsolicited && event.kind != Event::Kind::kUnexpectedBytes) return;
    bytes_ += static_cast<std::int64_t>(event.bytes.size());
    for (Reading& reading : readings_) Parse(reading, event.bytes, event.received);
  }
  void Parse(Reading& reading, Bytes bytes, Interval at) {
    reading.parser.Append(bytes, at);
    while (const std::optional<StreamParser::Found> found = reading.parser.Next()) {
      if (found->error) continue;
      ++reading.frames;
      reading.positions |= found->counts;
      if (!reading.first && found->last.last >= begin() + kSettle) reading.first = found;
      reading.last = found;
    }
  }
  [[nodiscard]] std::optional<ProbeHit> Judge(const Reading& reading) const {
    const auto size = static_cast<std::int64_t>(ReplySize(reading.bits));
    const std::int64_t framed = reading.frames * size;
    // At another rate, or of another device, whole frames are a rare accident.
    if (!reading.first || reading.frames < kMinFrames || 2 * framed < bytes_) return std::nullopt;
    const double seconds = static_cast<double>(reading.last->last.last - reading.first->last.last) / 1e9;
    const std::int64_t periods = (reading.last->position - reading.first->position) / size;
    if (seconds <= 0) return std::nullopt;
    ProbeHit finding;
    const bool sure = reading.frames >= kManyFrames && 10 * framed >= 9 * bytes_;
    finding.confidence = sure ? Confidence::kSure : Confidence::kLikely;
    finding.device = "SAA encoder that sends by itself";
    finding.reason = Text("%lld frames with the right sum make %lld of %lld bytes received",
                          static_cast<long long>(reading.frames), static_cast<long long>(framed),
                          static_cast<long long>(bytes_));
    finding.bus = {{"mode", "timing"}, {"refresh_hz", RateText(static_cast<double>(periods) / seconds)}};
    finding.keys = {{"bits", std::to_string(reading.bits)}};
    finding.check = BitsText(reading.bits, reading.positions) +
                    "; refresh_hz: as measured, the purchase order states it exactly";
    return finding;
  }

  std::int64_t bytes_ = 0;
  std::array<Reading, 3> readings_;
};

// ---- polled bus ----

// Asks one address after the other of a polled bus (BC AA BX). Such a request has no checksum, and one of its
// relatives clears an encoder to zero: so only at a rate that the operator names.
class PolledProbe final : public AskingProbe {
 public:
  PolledProbe(const LineFormat& line, int first, int last) : line_(line), first_(first), last_(last), x_(first) {}

  [[nodiscard]] std::vector<ProbeHit> Findings() const override { return findings_; }
  [[nodiscard]] double Progress() const override {
    return static_cast<double>(x_ - first_) / static_cast<double>(last_ - first_ + 1);
  }

 protected:
  [[nodiscard]] std::optional<Question> Ask() const override {
    if (x_ > last_) return std::nullopt;
    const auto command = static_cast<std::uint8_t>(kControlCommand | x_);
    const MonoNs timeout = line_.WireTime(kRequestSize + kLongestReply) + kPatience;
    Question question{.exchange = {.request = Request(command), .reply_length = &UntilTimeout, .timeout = timeout},
                      .quiet = kQuiet + line_.WireTime(kLongestReply)};
    question.exchange.shape.match =
        &MatchAnyFrame;  // every encoder may answer with the header 81: all replies look alike
    return question;
  }
  void Evaluate(const Event& event) override {
    ++tries_;
    const Bytes frame = FromStart(event.bytes);
    const int bits = BitsOfSize(frame.size());
    const auto command = static_cast<std::uint8_t>(kControlCommand | x_);
    if (bits != 0) {
      const Reply reply = ParseAnyFrame(frame, bits, command);
      const bool alike = answered_ == 0 || (bits == bits_ && reply.header == header_);
      if (reply.error == ReplyError::kNone && alike) {
        ++answered_;
        bits_ = bits;
        header_ = reply.header;
        positions_ |= reply.counts;
      }
    }
    if (!event.bytes.empty() && tries_ < kAttempts) return;
    if (answered_ > 0) Add();
    ++x_;
    tries_ = answered_ = 0;
    positions_ = 0;
  }

 private:
  void Add() {
    const bool own = header_ != kFixedHeader;
    ProbeHit finding;
    finding.confidence = answered_ < kAttempts ? Confidence::kPossible
                         : own                 ? Confidence::kSure
                                               : Confidence::kLikely;
    finding.device = Text("SAA encoder on a polled bus, address %d", x_);
    finding.reason = Text("%d of %d requests were answered by a frame with the right sum and %s", answered_, tries_,
                          own ? "its address" : "the header 81");
    finding.bus = {{"mode", "bus"}};
    finding.keys = {{"bits", std::to_string(bits_)},
                    {"address", std::to_string(x_)},
                    {"reply_header", own ? "address" : "\"81\""}};
    finding.check = BitsText(bits_, positions_);
    findings_.push_back(std::move(finding));
  }

  LineFormat line_;
  int first_;
  int last_;
  int x_;
  int tries_ = 0;
  int answered_ = 0;  // alike in length and header
  int bits_ = 0;      // the most that fit the answers' length
  std::uint8_t header_ = 0;
  std::uint32_t positions_ = 0;
  std::vector<ProbeHit> findings_;
};

// ---- what is tried ----

std::vector<ProbeTrial> ProbeTrials(const ProbeScope& scope) {
  std::vector<ProbeTrial> trials;
  for (const std::int64_t baud : scope.rates.empty() ? kUsualRates : scope.rates) {
    for (const Parity parity : {Parity::kNone, Parity::kEven, Parity::kOdd}) {
      ProbeTrial trial;
      trial.what = "SAA frames that come by themselves";
      trial.line = {.baud = baud, .parity = parity};
      trial.longest = kListen;
      trial.make = [](MonoNs now) { return std::make_unique<StreamProbe>(now); };
      trials.push_back(std::move(trial));
    }
  }
  const int first = std::max(0, scope.first_address);
  const int last = std::min(kLastX, scope.last_address);
  for (const std::int64_t baud : scope.rates) {
    const LineFormat line = {.baud = baud, .parity = scope.parity};
    ProbeTrial trial;
    trial.what = Text("SAA polled bus, addresses %d to %d", first, last);
    trial.asks = true;
    trial.line = line;
    trial.longest = (last - first + 1) * (line.WireTime(kRequestSize + kLongestReply) + kQuiet + kLatestProbeReply);
    trial.make = [line, first, last](MonoNs) { return std::make_unique<PolledProbe>(line, first, last); };
    if (first <= last) trials.push_back(std::move(trial));
  }
  return trials;
}

}  // namespace
}  // namespace axlecast::saa_serial

namespace axlecast {

std::vector<ProbeTrial> saa_serial_probe(const ProbeScope& scope) { return saa_serial::ProbeTrials(scope); }

}  // namespace axlecast
