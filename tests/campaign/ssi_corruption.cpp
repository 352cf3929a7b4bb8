// A campaign: words of SSI encoders with damaged bits through the whole device logic, in virtual time.
//
// Usage: ssi_corruption WORDS [MODE...]; prints a few lines of figures per mode; exit 1 when a position outside the bound
// was published valid, or a rate disagrees with theory.
//
// Theory. A bit that was sampled wrong passes unless something else of the transfer confirms it: the idle level, a zero
// that must come, the word again, parity. A pattern of inverted places of the position passes when every other sample of
// these places that is looked at is inverted too, and parity with it; nothing else that is looked at may be inverted. With
// c samples of a place, k inverted places and n samples looked at the share is
//
//   sum over the patterns of p^(sum of c, and 1 where parity turns) (1 - p)^(n - the same)
//
// 1.2 % of all words of 12 bits without anything else at p = 1e-3, 2.5e-5 of those of 25 bits that are read twice. The
// campaign sums over all patterns of up to three places, for every kLookEvery-th word; those whose position lies within the
// bound of the last published one - the model's speed over the time between, both uncertainties included - are expected to
// be published: that residue is physics.

#include <algorithm>
#include <array>
#include <axlecast/position_t.hpp>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/campaign/bit_flips.h"
#include "tests/campaign/campaign_main.h"
#include "tests/campaign/device_under_test.h"
#include "tests/campaign/sweep.h"
#include "tests/campaign/tally.h"

namespace axlecast {
namespace {

constexpr MonoNs kPeriod = kMillisecond;
constexpr std::int64_t kLookEvery = 512;
using Levels = std::vector<bool>;

enum class Behind { kUnchecked, kZeros, kAgain, kAgainAtOnce };

struct Mode {
  const char* name;
  const char* keys;  // of the bus
  const char* device;
  int turn_bits;
  int bits;
  int front;  // zeros before the position
  int rear;   // zeros behind it
  bool gray;
  bool parity;  // even, behind the rest
  int words;
  Behind behind;
  double max_rpm;
  double bit_error_rate;
  double garbage_rate;  // transfers of random bits
  double slip_rate;     // transfers that are read from the second clock on
};

constexpr const char* kSaa = "model: saa, bits: 12";
constexpr const char* kSaaAgain = "model: saa, bits: 12, repeat: no_gap, trailing: unchecked";
constexpr const char* kTree18 = "model: twk, bits: 10, turn_bits: 8";
constexpr const char* kTwice = "model: twk, bits: 13, turn_bits: 12, repeat: one_zero";
constexpr const char* kParity =
    "model: custom, code: gray, bits: 13, turn_bits: 11, parity: {bit: 25, sense: even}";
constexpr const char* kFlop = "monoflop_us: {min: 15, max: 25}, ";

constexpr const char* kSaaReal = "model: saa, bits: 12, limits: {speed_rpm: 3000, accel_rad_s2: 1000}";
constexpr const char* kTree18Real =
    "model: twk, bits: 10, turn_bits: 8, limits: {speed_rpm: 3000, accel_rad_s2: 1000}";

constexpr std::array<Mode, 9> kModes = {{
    {"saa_12_bits_1e-3", "", kSaa, 0, 12, 0, 0, false, false, 1, Behind::kUnchecked, 5'000, 1e-3, 0, 0},
    {"saa_12_bits_twice_1e-3", "", kSaaAgain, 0, 12, 0, 0, false, false, 2, Behind::kAgainAtOnce, 5'000, 1e-3, 0,
     0},
    {"twk_18_of_25_bits_1e-3", "", kTree18, 8, 10, 4, 3, true, false, 1, Behind::kZeros, 6'000, 1e-3, 0, 0},
    {"twk_25_bits_twice_1e-3", "", kTwice, 12, 13, 0, 0, true, false, 2, Behind::kAgain, 6'000, 1e-3, 0, 0},
    {"twk_25_bits_twice_1e-2", "", kTwice, 12, 13, 0, 0, true, false, 2, Behind::kAgain, 6'000, 1e-2, 0, 0},
    {"24_bits_and_parity_1e-3", kFlop, kParity, 11, 13, 0, 0, true, true, 1, Behind::kZeros, 6'000, 1e-3, 0, 0},
    {"twk_18_of_25_bits_garbage_and_slips", "", kTree18, 8, 10, 4, 3, true, false, 1, Behind::kZeros, 6'000, 0,
     1e-2, 1e-2},
    {"saa_12_bits_real_axis_1e-3", "", kSaaReal, 0, 12, 0, 0, false, false, 1, Behind::kUnchecked, kRealRpm, 1e-3,
     0, 0},
    {"twk_18_of_25_bits_real_axis_1e-3", "", kTree18Real, 8, 10, 4, 3, true, false, 1, Behind::kZeros, kRealRpm,
     1e-3, 0, 0},
}};

bool IsReal(const Mode& mode) { return mode.max_rpm == kRealRpm; }

std::string MachineText(const Mode& mode) {
  return std::string("machine: campaign\nbuses:\n  b: {family: ssi, simulate: true, ") + mode.keys +
         "devices: {axis1: {" + mode.device + ", unit: count, publish_hz: 1000}}}\n";
}

// ---- the encoder, from the documents (TWK SSI 4, 5, 7; SAA manual 5.5) ----

Levels WordOf(const Mode& mode, std::uint64_t position) {
  const int used = mode.turn_bits + mode.bits;
  const std::uint64_t code = mode.gray ? position ^ position >> 1U : position;
  Levels word(static_cast<std::size_t>(mode.front), false);
  for (int bit = used - 1; bit >= 0; --bit) word.push_back((code >> bit & 1) != 0);
  word.insert(word.end(), static_cast<std::size_t>(mode.rear), false);
  if (mode.parity) word.push_back(std::count(word.begin(), word.end(), true) % 2 == 1);
  return word;
}

// Which place of the word the host samples with each clock: -1 the idle level, -2 a zero, -3 something it ignores.
std::vector<int> PlacesOf(const Mode& mode, std::size_t clocks) {
  const int length = mode.front + mode.turn_bits + mode.bits + mode.rear + (mode.parity ? 1 : 0);
  const int gap = mode.behind == Behind::kAgain ? 1 : 0;
  std::vector<int> places = {-1};
  for (int clock = 0; places.size() < clocks; ++clock) {
    const int word = clock / (length + gap);
    const int place = clock % (length + gap);
    const bool again = mode.behind == Behind::kAgain || mode.behind == Behind::kAgainAtOnce;
    // The second mode compares two words and looks at nothing behind them.
    const bool looked_at = word < mode.words || mode.behind == Behind::kAgain || mode.behind == Behind::kZeros;
    const bool zero = place == length || (word > 0 && !again);
    places.push_back(!looked_at ? -3 : zero ? -2 : place);
  }
  return places;
}

// ---- the judge ----

class Referee final : public MessageSink {
 public:
  Referee(const Mode& mode, MonoNs zero) : mode_(mode), zero_(zero) {}

  [[nodiscard]] std::int64_t Range() const { return std::int64_t{1} << (mode_.turn_bits + mode_.bits); }

  [[nodiscard]] std::int64_t TruthAt(MonoNs at) const {
    const auto counts = static_cast<std::int64_t>(
        std::floor(std::ldexp(SweepTurns(at - zero_, IsReal(mode_) ? kRealSwing : kModelSwing), mode_.bits)));
    return counts & (Range() - 1);
  }

  void Publish(const std::string& channel, Bytes message) override {
    const std::optional<position_t> position = tally.Count(channel, message);
    if (!position) return;
    const std::int64_t told = static_cast<std::int64_t>(position->raw_turns) << mode_.bits | position->raw_counts;
    const bool right = told == TruthAt(position->mono_ns);
    if (!right) {
      ++tally.wrong;
      tally.outside += last_ && !Within(told, position->mono_ns) ? 1 : 0;
    } else {
      last_ = {told, position->mono_ns};
    }
  }

  // Whether the shaft can be there at `at`, since the last correct reading.
  [[nodiscard]] bool Within(std::int64_t position, MonoNs at) const {
    if (!last_) return false;
    const double per_ns = mode_.max_rpm / 60 * std::ldexp(1.0, mode_.bits) * 1e-9;
    const double way = std::remainder(static_cast<double>(position - last_->first), static_cast<double>(Range()));
    return std::abs(way) <= per_ns * static_cast<double>(at - last_->second) + kTolerance;
  }

  Tally tally;

 private:
  static constexpr double kTolerance = 4;  // counts: noise of both readings, and rounding
  const Mode& mode_;
  const MonoNs zero_;
  std::optional<std::pair<std::int64_t, MonoNs>> last_;  // position and instant of the last right one
};

struct Figures {
  std::int64_t words = 0;
  std::int64_t static_wrong = 0;  // damaged, passing every check of the transfer, with another position
  double expected_wrong = 0;
  double expected_published = 0;
};

class Campaign {
 public:
  Campaign(const MachineConfig& machine, const Mode& mode)
      : mode_(mode),
        flips_(mode.bit_error_rate, random_),
        referee_(mode, now_),
        axis_(machine.buses[0], referee_, now_),
        spi_(machine.buses[0].devices[0].settings->spi) {}

  void Run(std::int64_t words) {
    while (figures_.words < words) {
      axis_.Tick(now_);
      const Step step = axis_.device().Next({.now = now_, .poll_due = true});
      if (const auto* exchange = std::get_if<Exchange>(&step.action)) {
        axis_.device().OnStarted(step, now_);
        Transfer(exchange->request);
      }
      now_ += kPeriod;
    }
  }

  [[nodiscard]] const Figures& figures() const { return figures_; }
  [[nodiscard]] const Referee& referee() const { return referee_; }
  [[nodiscard]] const DevicePublisher& channel() const { return axis_.channel(); }

 private:
  void Transfer(Bytes request) {
    if (places_.empty()) {
      places_ = PlacesOf(mode_, request.size() * 8);
      sampled_.resize(places_.size());
      bytes_.resize(request.size());
    }
    const std::int64_t truth = referee_.TruthAt(now_);
    const Levels word = WordOf(mode_, static_cast<std::uint64_t>(truth));
    if (++figures_.words % kLookEvery == 0) Expect(truth);
    for (std::size_t i = 0; i < places_.size(); ++i) {
      sampled_[i] = places_[i] >= 0 ? word[static_cast<std::size_t>(places_[i])] : places_[i] == -1;
    }
    if (Damage() && Passes() && PositionIn() != truth) ++figures_.static_wrong;
    std::fill(bytes_.begin(), bytes_.end(), std::uint8_t{0});
    for (std::size_t i = 0; i < sampled_.size(); ++i) {
      if (sampled_[i]) bytes_[i / 8] = static_cast<std::uint8_t>(bytes_[i / 8] | 0x80U >> i % 8);
    }
    Tell(Event::Kind::kReply, request, bytes_);
  }

  // True when something was changed.
  bool Damage() {
    bool changed = false;
    flips_.Over(static_cast<std::int64_t>(sampled_.size()), [&](std::int64_t bit) {
      const auto at = static_cast<std::size_t>(bit);
      sampled_[at] = !sampled_[at];
      changed = true;
    });
    const double chance = mode_.garbage_rate + mode_.slip_rate > 0 ? share_(random_) : 1;
    if (chance < mode_.garbage_rate) {
      for (std::size_t i = 0; i < sampled_.size(); ++i) sampled_[i] = random_() % 2 == 1;
      return true;
    }
    if (chance < mode_.garbage_rate + mode_.slip_rate) {
      std::rotate(sampled_.begin(), sampled_.begin() + 1, sampled_.end());
      return true;
    }
    return changed;
  }

  // What one transfer alone can show, from the documents.
  [[nodiscard]] bool Passes() const {
    if (!sampled_[0] || std::count(sampled_.begin(), sampled_.end(), false) == 0) return false;
    const int position_end = mode_.front + mode_.turn_bits + mode_.bits;
    int ones = 0;
    for (std::size_t i = 1; i < places_.size(); ++i) {
      const int place = places_[i];
      if (place == -3) continue;
      const bool first = static_cast<int>(i) == place + 1;
      if (first && sampled_[i]) ++ones;
      const bool padding = place < mode_.front || (place >= position_end && place < position_end + mode_.rear);
      if (padding && sampled_[i]) return false;
      if (place >= 0 && sampled_[i] != sampled_[static_cast<std::size_t>(place) + 1]) return false;
    }
    return !mode_.parity || ones % 2 == 0;
  }

  [[nodiscard]] std::int64_t PositionIn() const {
    bool bit = false;
    std::int64_t position = 0;
    for (int i = 0; i < mode_.turn_bits + mode_.bits; ++i) {
      const int clock = 1 + mode_.front + i;
      const bool sampled = sampled_[static_cast<std::size_t>(clock)];
      bit = mode_.gray ? bit != sampled : sampled;
      position = position << 1 | (bit ? 1 : 0);
    }
    return position;
  }

  // All patterns of up to three inverted places of the position.
  void Expect(std::int64_t truth) {
    const auto looked_at = std::count_if(places_.begin(), places_.end(), [](int place) { return place != -3; });
    const int used = mode_.turn_bits + mode_.bits;
    const auto code_of = [this](std::int64_t position) { return mode_.gray ? position ^ position >> 1 : position; };
    const auto position_of = [this](std::int64_t code) {
      if (mode_.gray) {
        for (int shift = 1; shift < 32; shift *= 2) code ^= code >> shift;
      }
      return code;
    };
    const auto cost = [&](int bit) {
      return std::count(places_.begin(), places_.end(), mode_.front + used - 1 - bit);
    };
    const auto look = [&](std::int64_t pattern, std::int64_t inverted, int places) {
      const std::int64_t all = inverted + (mode_.parity && places % 2 == 1 ? 1 : 0);
      const double weight = std::pow(mode_.bit_error_rate, all) *
                            std::pow(1 - mode_.bit_error_rate, looked_at - all) * static_cast<double>(kLookEvery);
      figures_.expected_wrong += weight;
      if (referee_.Within(position_of(code_of(truth) ^ pattern), now_)) figures_.expected_published += weight;
    };
    for (int a = 0; a < used; ++a) {
      const std::int64_t one = std::int64_t{1} << a;
      look(one, cost(a), 1);
      for (int b = 0; b < a; ++b) {
        const std::int64_t two = one | std::int64_t{1} << b;
        look(two, cost(a) + cost(b), 2);
        for (int c = 0; c < b; ++c) look(two | std::int64_t{1} << c, cost(a) + cost(b) + cost(c), 3);
      }
    }
  }

  void Tell(Event::Kind kind, Bytes request, Bytes bytes) {
    const Interval sent = {now_, now_ + spi_.ClockTime(static_cast<std::int64_t>(bytes.size()) * 8)};
    axis_.device().On(
        {.kind = kind, .sent = sent, .received = {sent.last, sent.last}, .request = request, .bytes = bytes});
  }

  const Mode& mode_;
  std::mt19937_64 random_{20'261'121};
  BitFlips flips_;
  std::uniform_real_distribution<double> share_{0, 1};
  MonoNs now_ = 10 * kSecond;
  std::vector<int> places_;
  Levels sampled_;
  std::vector<std::uint8_t> bytes_;
  Referee referee_;
  DeviceUnderTest axis_;
  SpiSettings spi_;
  Figures figures_;
};

bool RunMode(const Mode& mode, std::int64_t words) {
  const std::optional<MachineConfig> machine = CampaignMachine(MachineText(mode));
  if (!machine) return false;
  Campaign campaign(*machine, mode);
  campaign.Run(words);
  const Figures& figures = campaign.figures();
  const Tally& tally = campaign.referee().tally;
  std::printf("%s\n  words %lld; published valid %lld, withheld %lld\n", mode.name, Long{figures.words},
              Long{tally.valid}, Long{tally.withheld});
  std::printf("  passing the checks of one transfer with another position %lld (theory %.1f)\n",
              Long{figures.static_wrong}, figures.expected_wrong);
  PrintWrong(tally, figures.expected_published);
  PrintErrors(campaign.channel());
  // The theory of what is published knows speed only; acceleration leaves less.
  const bool published = IsReal(mode) ? static_cast<double>(tally.wrong) <= figures.expected_published + 3
                                      : Agrees(tally.wrong, figures.expected_published);
  const bool theory =
      mode.bit_error_rate == 0 || (Agrees(figures.static_wrong, figures.expected_wrong) && published);
  return theory && tally.outside == 0 && tally.valid > figures.words / 4;
}

}  // namespace
}  // namespace axlecast

int main(int argc, char** argv) {
  return axlecast::CampaignMain(argc, argv, "ssi_corruption WORDS [MODE...]",
                                "no position outside the bound was published valid", axlecast::kModes,
                                axlecast::RunMode);
}
