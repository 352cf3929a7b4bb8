// A campaign: damaged BiSS-C transfers through the whole device logic, in virtual time.
//
// A shaft turns within its limits and is read at 1 kHz; every sample of a transfer may be inverted, or whole transfers
// be noise. Each published position is compared with where the shaft was, and with what is possible since the last right
// one. Frames, their search and their check are written here a second time, from the SAA manual 5.6, on one word of 64
// bits; all patterns of up to four inverted samples give the rates to expect.
//
// Usage: biss_frames TRANSFERS [MODE...]; prints some lines of figures per mode; exit 1 when a position outside the
// bound was published valid, or a rate disagrees with theory.

#include <array>
#include <axlecast/position_t.hpp>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <random>
#include <string>

#include "tests/campaign/bit_flips.h"
#include "tests/campaign/campaign_main.h"
#include "tests/campaign/device_under_test.h"
#include "tests/campaign/sweep.h"
#include "tests/campaign/tally.h"

namespace axlecast {
namespace {

constexpr MonoNs kPeriod = kMillisecond;
constexpr double kMaxSpeedRpm = 5'000;  // SAA manual 4.2
constexpr unsigned kAckAt = 2;          // the second rising edge, seen at once
constexpr unsigned kBusyClocks = 2;     // Tbusy
constexpr unsigned kCheckBits = 6;
constexpr std::int64_t kLookEvery = 50'000;  // transfers whose patterns are all looked at

struct Mode {
  const char* name;
  unsigned bits;
  double bit_error_rate;
  double noise_rate;  // share of transfers that are noise
};
constexpr std::array<Mode, 6> kModes = {{{"bits16_flips_1e-3", 16, 1e-3, 0},
                                         {"bits16_flips_1e-2", 16, 1e-2, 0},
                                         {"bits24_flips_1e-3", 24, 1e-3, 0},
                                         {"bits24_flips_1e-2", 24, 1e-2, 0},
                                         {"bits16_noise_1e-2", 16, 0, 1e-2},
                                         {"bits24_noise_1e-2", 24, 0, 1e-2}}};

std::string MachineText(unsigned bits) {
  return "machine: campaign\nbuses:\n  b: {family: biss, poll_hz: 1000, simulate: true, line_delay_ns: 0, "
         "devices: {axis1: {bits: " +
         std::to_string(bits) + ", busy_us: 2, unit: count, publish_hz: 1000}}}\n";
}

// ---- the frame, from 5.6 ----

// The first sample of a transfer is the highest bit.
using Samples = std::uint64_t;

// The remainder of the division by x^6 + x + 1, inverted.
std::uint64_t CheckOf(std::uint64_t covered, unsigned count) {
  std::uint64_t rest = covered << kCheckBits;
  for (unsigned i = count + kCheckBits; i-- > kCheckBits;) {
    if ((rest >> i & 1U) != 0) rest ^= std::uint64_t{0x43} << (i - kCheckBits);
  }
  return rest ^ 0x3FU;
}

Samples TransferOf(std::uint64_t counts, unsigned bits) {
  const std::uint64_t covered = counts << 2U | 3U;
  const std::uint64_t frame = covered << kCheckBits | CheckOf(covered, bits + 2);
  const unsigned length = bits + 2 + kCheckBits;
  // Two high, two of acknowledgement, start bit, fixed 0.
  const Samples head = std::uint64_t{0b110010} << 58U;
  return head | frame << (58U - length);
}

struct Seen {
  bool passes = false;
  bool valid = false;  // nError is not active
  std::uint64_t counts = 0;
};
Seen Look(Samples samples, unsigned bits) {
  if (samples >> 62U != 3) return {};
  // busy_us: 2 and no delay: the start bit comes with one of five samples.
  const unsigned start = kAckAt + static_cast<unsigned>(std::countl_zero(samples << kAckAt));
  if (start == kAckAt || start > kAckAt + kBusyClocks + 1) return {};
  if ((samples << (start + 1) >> 63U) != 0) return {};
  const unsigned length = bits + 2 + kCheckBits;
  const std::uint64_t frame = samples << (start + 2) >> (64U - length);
  const std::uint64_t covered = frame >> kCheckBits;
  if (CheckOf(covered, bits + 2) != (frame & 0x3FU)) return {};
  return {true, (covered & 2U) != 0, covered >> 2U};
}

// ---- the judge ----

struct Bound {
  std::optional<position_t> last;  // right
  double turn = 0;
  double tolerance = 0;

  // Whether the shaft can be there at `at`, since the last correct reading.
  [[nodiscard]] bool Holds(std::int64_t counts, MonoNs at) const {
    if (!last) return false;
    const double elapsed = static_cast<double>(at - last->mono_ns) + last->time_uncertainty_ns;
    const double way = std::remainder(static_cast<double>(counts - last->raw_counts), turn);
    return std::abs(way) <= Reach(elapsed);
  }
  [[nodiscard]] double Reach(double elapsed) const { return kMaxSpeedRpm / 60 * turn * 1e-9 * elapsed + tolerance; }
  [[nodiscard]] double ShareOfTurn(MonoNs elapsed) const {
    return (2 * Reach(static_cast<double>(elapsed)) + 1) / turn;
  }
};

class Referee final : public MessageSink {
 public:
  explicit Referee(const BusConfig& bus) {
    const DeviceSettings& settings = *bus.devices[0].settings;
    bound.turn = static_cast<double>(settings.counts_per_turn);
    bound.tolerance = static_cast<double>(settings.noise_counts) + 2;
  }

  void Publish(const std::string& channel, Bytes message) override {
    const std::optional<position_t> position = tally.Count(channel, message);
    if (!position) return;
    const bool right = position->raw_counts == truth;
    if (right || !bound.last) {
      bound.last = position;
      return;
    }
    ++tally.wrong;
    tally.outside += bound.Holds(position->raw_counts, position->mono_ns + position->time_uncertainty_ns) ? 0 : 1;
  }

  Bound bound;
  std::int64_t truth = 0;
  Tally tally;
};

struct Figures {
  std::int64_t transfers = 0, damaged = 0, passing = 0;
  double expected_passing = 0, expected_published = 0;
};

class Campaign {
 public:
  Campaign(const BusConfig& bus, const Mode& mode)
      : mode_(mode),
        flips_(mode.bit_error_rate, random_),
        noise_(mode.noise_rate),
        referee_(bus),
        axis_(bus, referee_, now_) {
    const Step step = axis_.device().Next({.now = now_, .poll_due = true});
    request_ = std::get<Exchange>(step.action).request;
  }

  void Run(std::int64_t transfers) {
    for (; figures_.transfers < transfers; now_ += kPeriod) {
      axis_.Tick(now_);
      Transfer();
    }
  }

  [[nodiscard]] const Figures& figures() const { return figures_; }
  [[nodiscard]] const Referee& referee() const { return referee_; }
  [[nodiscard]] const DevicePublisher& channel() const { return axis_.channel(); }
  [[nodiscard]] std::size_t samples() const { return request_.size() * 8; }

 private:
  [[nodiscard]] std::uint64_t TruthCounts() const {
    const double turns = SweepTurns(now_);
    return static_cast<std::uint64_t>((turns - std::floor(turns)) * referee_.bound.turn);
  }

  void Transfer() {
    const std::uint64_t truth = TruthCounts();
    const Samples good = TransferOf(truth, mode_.bits);
    if (++figures_.transfers % kLookEvery == 0 && mode_.bit_error_rate > 0) Expect(good, truth);
    const Samples sent = Damage(good);
    figures_.damaged += sent != good ? 1 : 0;
    const Seen seen = Look(sent, mode_.bits);
    figures_.passing += sent != good && seen.passes && seen.counts != truth ? 1 : 0;
    referee_.truth = static_cast<std::int64_t>(truth);
    std::array<std::uint8_t, 8> bytes{};
    for (unsigned i = 0; i < 8; ++i) bytes[i] = static_cast<std::uint8_t>(sent >> (56U - 8 * i));
    const MonoNs end = now_ + static_cast<MonoNs>(samples()) * kMicrosecond;
    axis_.device().On({.kind = Event::Kind::kReply,
                       .sent = {now_, end},
                       .received = {end, end},
                       .request = request_,
                       .bytes = Bytes(bytes).first(request_.size())});
  }

  Samples Damage(Samples samples) {
    if (mode_.noise_rate > 0) return noise_(random_) ? random_() & Mask() : samples;
    flips_.Over(static_cast<std::int64_t>(this->samples()),
                [&](std::int64_t at) { samples ^= Samples{1} << (63U - static_cast<unsigned>(at)); });
    return samples;
  }
  [[nodiscard]] Samples Mask() const { return ~Samples{0} << (64U - static_cast<unsigned>(samples())); }

  // Latched half a cycle after the transfer began.
  [[nodiscard]] bool Holds(std::uint64_t counts) const {
    return referee_.bound.Holds(static_cast<std::int64_t>(counts), now_ + kMicrosecond / 2);
  }

  // All patterns of up to four inverted samples of this transfer.
  void Expect(Samples good, std::uint64_t truth) {
    const auto count = static_cast<unsigned>(samples());
    const double p = mode_.bit_error_rate;
    const auto look = [&](Samples pattern, int flips) {
      const Seen seen = Look(good ^ pattern, mode_.bits);
      if (!seen.passes || seen.counts == truth) return;
      const double weight =
          std::pow(p, flips) * std::pow(1 - p, static_cast<int>(count) - flips) * static_cast<double>(kLookEvery);
      figures_.expected_passing += weight;
      if (seen.valid && Holds(seen.counts)) figures_.expected_published += weight;
    };
    const auto at = [](unsigned i) { return Samples{1} << (63U - i); };
    for (unsigned a = 0; a < count; ++a) {
      look(at(a), 1);
      for (unsigned b = 0; b < a; ++b) {
        look(at(a) | at(b), 2);
        for (unsigned c = 0; c < b; ++c) {
          look(at(a) | at(b) | at(c), 3);
          for (unsigned d = 0; d < c; ++d) look(at(a) | at(b) | at(c) | at(d), 4);
        }
      }
    }
  }

  const Mode mode_;
  std::mt19937_64 random_{20'261'121};
  BitFlips flips_;
  std::bernoulli_distribution noise_;
  MonoNs now_ = 10 * kSecond;
  Referee referee_;
  DeviceUnderTest axis_;
  Frame request_;
  Figures figures_;
};

bool RunMode(const Mode& mode, std::int64_t transfers) {
  const std::optional<MachineConfig> machine = CampaignMachine(MachineText(mode.bits));
  if (!machine) return false;
  Campaign campaign(machine->buses[0], mode);
  campaign.Run(transfers);
  Figures figures = campaign.figures();
  const Tally& tally = campaign.referee().tally;
  if (mode.noise_rate > 0) {
    // Two high, then one, two or three low, and 10; one frame in 64 has the right check bits. Half of these claim that they
    // are valid, and their positions are anywhere.
    const double shape = 0.25 * (1.0 / 8 + 1.0 / 16 + 1.0 / 32);
    figures.expected_passing = static_cast<double>(figures.damaged) * shape / 64;
    figures.expected_published = figures.expected_passing / 2 * campaign.referee().bound.ShareOfTurn(kPeriod);
  }
  std::printf("%s\n  transfers %lld of %zu samples, damaged %lld; published valid %lld, withheld %lld\n", mode.name,
              Long{figures.transfers}, campaign.samples(), Long{figures.damaged}, Long{tally.valid},
              Long{tally.withheld});
  std::printf("  wrong, passing the checks of one frame: %lld (theory %.0f)\n", Long{figures.passing},
              figures.expected_passing);
  PrintWrong(tally, figures.expected_published);
  PrintErrors(campaign.channel());
  return tally.outside == 0 && tally.valid > figures.transfers / 4 &&
         Agrees(figures.passing, figures.expected_passing) && Agrees(tally.wrong, figures.expected_published);
}

}  // namespace
}  // namespace axlecast

int main(int argc, char** argv) {
  return axlecast::CampaignMain(argc, argv, "biss_frames TRANSFERS [MODE...]",
                                "no position outside the bound was published valid", axlecast::kModes,
                                axlecast::RunMode);
}
