// A campaign: the stream of an SAA encoder in mode timing with noise on the line, through the parser and through the
// whole device logic, in virtual time.
//
// Usage: saa_stream_noise BYTES [MODE...]; prints a few lines of figures per mode; exit 1 when a good frame that is not
// adjacent to a bad byte was lost, a position outside the bound was published valid, or a rate disagrees with theory.
//
// Theory. A frame of N data bytes has 8 (N + 3) bits, each inverted with probability p. It passes as another position
// when both header bytes are whole (16 bits) and the sum agrees. To leading order that takes two inverted bits of one
// column k among the N data bytes and the checksum: two data bits that change the sum in opposite ways, or a data bit
// and the checksum's that change in the same way. Either holds for half of all data, and always in column 7, because
// +-128 is the same modulo 256. There are N (N + 1) / 2 pairs of bytes, hence
//
//   share of wrong frames = N (N + 1) / 2 * (7 / 2 + 1) * p^2 (1 - p)^(8 (N + 3) - 2)
//
// 1.30e-5 at p = 1e-3 and N = 2. The campaign compares with the exact sum that this is the begin of: for every
// kLookEvery-th frame it tries all patterns of up to three inverted data bits, each with the checksum that makes it pass.
// Those whose position lies within the bound of the last published one - 5,000 rpm over the time between, both
// uncertainties included - are expected to be published: that residue is physics.

#include <algorithm>
#include <array>
#include <axlecast/position_t.hpp>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "drivers/saa_serial/stream_parser.h"
#include "tests/campaign/bit_flips.h"
#include "tests/campaign/campaign_main.h"
#include "tests/campaign/device_under_test.h"
#include "tests/campaign/sweep.h"
#include "tests/campaign/tally.h"

namespace axlecast {
namespace {

constexpr MonoNs kPeriod = 200 * kMicrosecond;
constexpr double kMaxSpeedRpm = 5'000;  // SAA manual 4.2, of an axis without limits of its own
constexpr std::int64_t kLookEvery = 512;
using saa_serial::StreamParser;

struct Mode {
  const char* name;
  unsigned bits;
  double bit_error_rate;
  double byte_fault_rate;  // of frames that lose or gain a byte
  double tolerance;        // counts: twice the accuracy of SAA manual 4.1, 40" and 5", and rounding
  bool real_axis;          // its limits are in the file
};
constexpr std::array<Mode, 8> kModes = {{{"16_bits_1e-3", 16, 1e-3, 0, 6, false},
                                         {"16_bits_1e-2", 16, 1e-2, 0, 6, false},
                                         {"24_bits_1e-3", 24, 1e-3, 0, 131, false},
                                         {"24_bits_1e-2", 24, 1e-2, 0, 131, false},
                                         {"16_bits_1e-3_and_shifts", 16, 1e-3, 1e-2, 6, false},
                                         {"24_bits_1e-2_and_shifts", 24, 1e-2, 1e-2, 131, false},
                                         {"16_bits_real_axis_1e-3", 16, 1e-3, 0, 6, true},
                                         {"24_bits_real_axis_1e-3", 24, 1e-3, 0, 131, true}}};

std::string MachineText(unsigned bits, bool real_axis) {
  return "machine: campaign\nbuses:\n  b: {family: saa_serial, mode: timing, refresh_hz: 5000, simulate: true,\n"
         "      link: {baud: 921600}, devices: {axis1: {bits: " +
         std::to_string(bits) + ", processing_us: 0, latency_us: 0, unit: count, publish_hz: 20000" +
         (real_axis ? std::string(", ") + kRealLimits : "") + "}}}\n";
}

using ByteList = std::vector<std::uint8_t>;

// SAA manual 5.1.1 (2), tables.
std::uint8_t SumOf(std::uint32_t counts) {
  return static_cast<std::uint8_t>(0xFF + 0x81 + (counts >> 16U) + (counts >> 8U) + counts);
}

ByteList FrameOf(std::uint32_t counts, unsigned bits) {
  ByteList frame = {0xFF, 0x81};
  for (unsigned byte = bits / 8; byte-- > 0;) frame.push_back(static_cast<std::uint8_t>(counts >> 8 * byte));
  frame.push_back(SumOf(counts));
  return frame;
}

// A frame as sent, and what became of its bytes.
struct Sent {
  std::int64_t position = 0;  // in the stream
  MonoNs at = 0;
  std::uint32_t counts = 0;
  bool good = true;      // no byte of it was touched
  bool isolated = true;  // nor the one before, nor the one behind
};

// What the parser alone made of the stream.
struct Figures {
  std::int64_t frames = 0, good = 0, lost = 0, lost_isolated = 0;
  std::int64_t wrong = 0;      // found in its place, with another position
  std::int64_t elsewhere = 0;  // found where no frame was sent, with a position that was not sent
  double expected_wrong = 0, expected_published = 0;
};

// Judges every published position by the frames sent lately, and by where the shaft can be.
class Referee final : public MessageSink {
 public:
  Referee(const Mode& mode, const std::deque<Sent>& sent)
      : sent_(sent),
        turn_(static_cast<double>(1U << mode.bits)),
        per_ns_((mode.real_axis ? kRealRpm : kMaxSpeedRpm) / 60 * turn_ * 1e-9),
        tolerance_(mode.tolerance) {}

  void Publish(const std::string& channel, Bytes message) override {
    const std::optional<position_t> position = tally.Count(channel, message);
    if (!position) return;
    const bool right = std::any_of(sent_.begin(), sent_.end(),
                                   [&](const Sent& sent) { return sent.counts == position->raw_counts; });
    if (!right) {
      ++tally.wrong;
      tally.outside +=
          last_ && !Within(position->raw_counts, position->mono_ns + position->time_uncertainty_ns) ? 1 : 0;
    }
    if (right || !last_) last_ = position;
  }

  // Whether the shaft can be there at `at`, since the last correct reading.
  [[nodiscard]] bool Within(std::int64_t counts, MonoNs at) const {
    if (!last_) return false;
    const double elapsed = static_cast<double>(at - last_->mono_ns) + last_->time_uncertainty_ns;
    const double way = std::remainder(static_cast<double>(counts - last_->raw_counts), turn_);
    return std::abs(way) <= per_ns_ * elapsed + tolerance_;
  }

  Tally tally;

 private:
  const std::deque<Sent>& sent_;
  const double turn_;
  const double per_ns_;
  const double tolerance_;
  std::optional<position_t> last_;
};

class Campaign {
 public:
  Campaign(const MachineConfig& machine, const Mode& mode)
      : mode_(mode),
        flips_(mode.bit_error_rate, random_),
        shift_(mode.byte_fault_rate),
        referee_(mode, sent_),
        axis_(machine.buses[0], referee_, now_),
        parser_(static_cast<int>(mode.bits)) {}

  void Run(std::int64_t bytes) {
    while (position_ < bytes) {
      axis_.Tick(now_);
      Send();
      axis_.device().On({.kind = Event::Kind::kUnsolicited,
                         .sent = {},
                         .received = {now_, now_},
                         .request = {},
                         .bytes = frame_});
      parser_.Append(frame_, {now_, now_});
      while (const auto found = parser_.Next()) Judge(*found);
      now_ += kPeriod;
    }
  }

  [[nodiscard]] const Figures& figures() const { return figures_; }
  [[nodiscard]] const Referee& referee() const { return referee_; }
  [[nodiscard]] const StreamParser& parser() const { return parser_; }

 private:
  [[nodiscard]] std::uint32_t TruthCounts() const {
    const double turns = SweepTurns(now_, mode_.real_axis ? kRealSwing : kModelSwing);
    return static_cast<std::uint32_t>((turns - std::floor(turns)) * static_cast<double>(1U << mode_.bits));
  }

  void Send() {
    Sent sent{.position = position_, .at = now_, .counts = TruthCounts()};
    if (++figures_.frames % kLookEvery == 0) Expect(sent.counts);
    frame_ = FrameOf(sent.counts, mode_.bits);
    touched_.assign(frame_.size(), false);
    Flip();
    if (mode_.byte_fault_rate > 0 && shift_(random_)) Shift(sent);
    sent.good = sent.good && std::none_of(touched_.begin(), touched_.end(), [](bool is) { return is; });
    if (!sent_.empty() && touched_.front()) sent_.back().isolated = false;
    sent.isolated = !last_touched_;
    last_touched_ = touched_.back();
    figures_.good += sent.good ? 1 : 0;
    position_ += static_cast<std::int64_t>(frame_.size());
    sent_.push_back(sent);
  }

  void Flip() {
    flips_.Over(static_cast<std::int64_t>(frame_.size()) * 8, [&](std::int64_t bit) {
      const auto byte = static_cast<std::size_t>(bit / 8);
      frame_[byte] ^= static_cast<std::uint8_t>(1U << (bit % 8));
      touched_[byte] = true;
    });
  }

  // One byte is lost, which its neighbour in the frame replaces, or one comes in between.
  void Shift(Sent& sent) {
    const std::size_t at = random_() % frame_.size();
    const auto offset = static_cast<std::ptrdiff_t>(at);
    sent.good = false;
    if (random_() % 2 == 0) {
      frame_.erase(frame_.begin() + offset);
      touched_.erase(touched_.begin() + offset);
      touched_[std::min(at, touched_.size() - 1)] = true;
    } else {
      frame_.insert(frame_.begin() + offset, static_cast<std::uint8_t>(random_()));
      touched_.insert(touched_.begin() + offset, true);
    }
  }

  void Judge(const StreamParser::Found& found) {
    if (found.error) return;
    while (sent_.size() > 1 && sent_.front().position < found.position) {
      if (sent_.front().good) Lose(sent_.front());
      sent_.pop_front();
    }
    const Sent& sent = sent_.front();
    if (sent.position != found.position) {
      // A byte too many before or behind the frame leaves it whole.
      figures_.elsewhere += Known(found.counts) ? 0 : 1;
      return;
    }
    figures_.wrong += sent.counts != found.counts ? 1 : 0;
    if (sent_.size() > 1)
      sent_.pop_front();
    else
      sent_.front().good = false;  // it stays for the referee, and is not missed
  }

  [[nodiscard]] bool Known(std::uint32_t counts) const {
    return std::any_of(sent_.begin(), sent_.end(), [counts](const Sent& sent) { return sent.counts == counts; });
  }

  void Lose(const Sent& sent) {
    ++figures_.lost;
    if (!sent.isolated) return;
    ++figures_.lost_isolated;
    std::printf("  lost: counts %X at byte %lld\n", sent.counts, Long{sent.position});
  }

  // All patterns of up to three inverted data bits of this frame, and the sum that each needs.
  void Expect(std::uint32_t counts) {
    const unsigned data = mode_.bits;
    const int rest = 16 + static_cast<int>(data) + 8;
    const unsigned sum = SumOf(counts);
    const auto look = [&](std::uint32_t pattern, int flips) {
      const std::uint32_t other = counts ^ pattern;
      const int inverted = flips + std::popcount(sum ^ SumOf(other));
      const double weight = std::pow(mode_.bit_error_rate, inverted) *
                            std::pow(1 - mode_.bit_error_rate, rest - inverted) * static_cast<double>(kLookEvery);
      figures_.expected_wrong += weight;
      if (referee_.Within(other, now_)) figures_.expected_published += weight;
    };
    for (unsigned a = 0; a < data; ++a) {
      look(1U << a, 1);
      for (unsigned b = 0; b < a; ++b) {
        look(1U << a | 1U << b, 2);
        for (unsigned c = 0; c < b; ++c) look(1U << a | 1U << b | 1U << c, 3);
      }
    }
  }

  Mode mode_;
  std::mt19937_64 random_{20'261'121};
  BitFlips flips_;
  std::bernoulli_distribution shift_;
  MonoNs now_ = 10 * kSecond;
  std::int64_t position_ = 0;
  ByteList frame_;
  std::vector<bool> touched_;
  bool last_touched_ = false;
  std::deque<Sent> sent_;
  Referee referee_;
  DeviceUnderTest axis_;
  StreamParser parser_;
  Figures figures_;
};

bool RunMode(const Mode& mode, std::int64_t bytes) {
  const std::optional<MachineConfig> machine = CampaignMachine(MachineText(mode.bits, mode.real_axis));
  if (!machine) return false;
  Campaign campaign(*machine, mode);
  campaign.Run(bytes);
  const Figures& figures = campaign.figures();
  const Tally& tally = campaign.referee().tally;
  std::printf(
      "%s\n  frames %lld, of these good %lld; good ones lost %lld, of these not adjacent to a bad byte %lld\n",
      mode.name, Long{figures.frames}, Long{figures.good}, Long{figures.lost}, Long{figures.lost_isolated});
  std::printf("  found with another position: in its place %lld (theory %.0f), elsewhere %lld\n",
              Long{figures.wrong}, figures.expected_wrong, Long{figures.elsewhere});
  std::printf(
      "  published valid %lld, withheld %lld; valid and wrong: outside the bound %lld, inside it %lld (theory "
      "%.1f)\n",
      Long{tally.valid}, Long{tally.withheld}, Long{tally.outside}, Long{tally.wrong - tally.outside},
      figures.expected_published);
  std::printf("  bytes of no frame %lld\n", Long{campaign.parser().skipped()});
  // The theory of what is published knows speed only; acceleration leaves less.
  const bool published = mode.real_axis ? static_cast<double>(tally.wrong) <= figures.expected_published + 3
                                        : Agrees(tally.wrong, figures.expected_published);
  const bool theory = mode.byte_fault_rate > 0 || (Agrees(figures.wrong, figures.expected_wrong) && published);
  return theory && figures.lost_isolated == 0 && tally.outside == 0 && tally.valid > figures.frames / 4;
}

}  // namespace
}  // namespace axlecast

int main(int argc, char** argv) {
  return axlecast::CampaignMain(
      argc, argv, "saa_stream_noise BYTES [MODE...]",
      "no isolated good frame was lost, no position outside the bound was published valid", axlecast::kModes,
      axlecast::RunMode);
}
