// A campaign: damaged replies through the whole device logic, in virtual time.
//
// An encoder turns at up to its limits; every reply to the driver may be damaged on the wire. Each published position is
// compared with where the shaft really was, and with what is possible since the position published before. The checks of
// a single frame are repeated here from the document, naively, to compare their residue with theory.
//
// Two axes: one that turns as fast as the model allows, and knows its sampling instants within one exchange (a simulated
// line); and a real one, whose `limits` are in the file, on a line whose characters take their time.
//
// Usage: corrupted_replies EXCHANGES [MODE...]; prints one line of figures per mode; exit 1 when a position outside
// the bound was published valid, a good reading was withheld, more wrong ones were published than the goal allows, or a
// rate disagrees with theory.

#include <algorithm>
#include <array>
#include <axlecast/position_t.hpp>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "tests/campaign/bit_flips.h"
#include "tests/campaign/campaign_main.h"
#include "tests/campaign/device_under_test.h"
#include "tests/campaign/tally.h"

namespace axlecast {
namespace {

constexpr std::int64_t kCountsPerTurn = 131'072;  // TS5669, 17 bits
constexpr MonoNs kExchangeTime = 51 * kMicrosecond;

struct Shaft {
  const char* machine;
  double max_rpm;
  double sweep;        // turns: a slow one over many turns, with a fast oscillation on it
  double oscillation;  // turns
  double accuracy;     // counts: what the encoder may be off by, which is no error of the line
};

constexpr Shaft kModelLimits = {R"(
machine: campaign
buses:
  b: {family: tformat, poll_hz: 0, simulate: true,
      devices: {axis1: {model: ts5669n127, unit: count, publish_hz: 20000}}}
)",
                                6'000, 500, 3, 0};

// 2,900 min-1 and 660 rad/s2 at most.
constexpr Shaft kRealAxis = {R"(
machine: campaign
buses:
  b: {family: tformat, poll_hz: 0, link: {port: /dev/null},
      devices: {axis1: {model: ts5669n127, unit: count, publish_hz: 20000,
                        limits: {speed_rpm: 3000, accel_rad_s2: 1000}}}}
)",
                             3'000, 400, 0.7, 8};

double TruthCounts(const Shaft& shaft, MonoNs at) {
  const double t = static_cast<double>(at) * 1e-9;
  const double turns = 2'000.0 + shaft.sweep * std::sin(t * 0.1) + shaft.oscillation * std::sin(t * 12.0);
  return turns * static_cast<double>(kCountsPerTurn);
}

using Reply = std::vector<std::uint8_t>;

// Spec 6.3: CF SF ABS0-2 ENID ABM0-2 ALMC CRC.
void TrueReply(const Shaft& shaft, MonoNs at, Reply& reply) {
  const auto counts = static_cast<std::int64_t>(std::floor(TruthCounts(shaft, at)));
  const auto single = static_cast<std::uint32_t>(counts % kCountsPerTurn);
  const auto turns = static_cast<std::uint32_t>(counts / kCountsPerTurn);
  const auto byte = [](std::uint32_t value, unsigned index) {
    return static_cast<std::uint8_t>(value >> 8U * index);
  };
  reply.assign({0x1A, 0x00, byte(single, 0), byte(single, 1), byte(single, 2), 0x11, byte(turns, 0), byte(turns, 1),
                byte(turns, 2), 0x00});
  std::uint8_t crc = 0;
  for (const std::uint8_t field : reply) crc ^= field;
  reply.push_back(crc);
}

// What one frame alone can show, from the document: length, CRC, CF, information bits, ENID, always-zero bits.
bool PassesStaticChecks(const Reply& reply) {
  if (reply.size() != 11) return false;
  std::uint8_t crc = 0;
  for (const std::uint8_t field : reply) crc ^= field;
  return crc == 0 && reply[0] == 0x1A && (reply[1] & 0xCF) == 0 && reply[4] <= 1 && reply[5] == 0x11 &&
         reply[8] == 0 && (reply[9] & 0x10) == 0;
}

// SF states of counting error, and of the OR of ME, BE and BA, the same as ALMC. The driver refuses the first reply that
// does not: a contradiction that stays can be the encoder's own.
bool StatusAgrees(const Reply& reply) {
  return ((reply[1] & 0x10) != 0) == ((reply[9] & 0x04) != 0) &&
         ((reply[1] & 0x20) != 0) == ((reply[9] & 0xE0) != 0);
}

std::int64_t Position(const Reply& reply) {
  return reply[2] | reply[3] << 8 | reply[4] << 16 | static_cast<std::int64_t>(reply[6] | reply[7] << 8) << 17;
}

class Damage {
 public:
  Damage(double bit_error_rate, double byte_fault_rate, bool garbage)
      : flips_(bit_error_rate, random_), fault_(byte_fault_rate), garbage_(garbage) {}

  void Apply(Reply& reply) {
    flips_.Over(static_cast<std::int64_t>(reply.size()) * 8, [&](std::int64_t bit) {
      reply[static_cast<std::size_t>(bit / 8)] ^= static_cast<std::uint8_t>(1U << (bit % 8));
    });
    if (!fault_(random_)) return;
    const std::size_t at = random_() % reply.size();
    const auto where = reply.begin() + static_cast<std::ptrdiff_t>(at);
    switch (garbage_ ? 3 : random_() % 3) {
      case 0:
        reply.erase(where);
        break;
      case 1:
        reply.insert(where, reply[at]);
        break;
      case 2:
        reply.insert(where, static_cast<std::uint8_t>(random_()));
        break;
      default:
        std::generate(reply.begin(), reply.end(), [&] { return static_cast<std::uint8_t>(random_()); });
    }
  }

 private:
  std::mt19937_64 random_{20'261'121};
  BitFlips flips_;
  std::bernoulli_distribution fault_;
  bool garbage_;
};

// Judges every published position by the truth, and by where the shaft can be since the last correct reading.
class Referee final : public MessageSink {
 public:
  explicit Referee(const Shaft& shaft) : shaft_(shaft) {}

  void Publish(const std::string& channel, Bytes message) override {
    const std::optional<position_t> position = tally.Count(channel, message);
    if (position) Judge(*position);
  }

  Tally tally;
  std::int64_t wrong_close = 0;

 private:
  void Judge(const position_t& position) {
    const double error = Distance(position, TruthCounts(shaft_, position.mono_ns));
    // What the position claims: the uncertainty of its instant at full speed, the encoder's accuracy (5 bits where it is
    // flagged so), and the rounding to a count.
    const bool five_bits = shaft_.accuracy > 0 && (position.flags & position_t::FLAG_LOW_ACCURACY) != 0;
    const double accuracy = five_bits ? static_cast<double>(kCountsPerTurn) / 32 : shaft_.accuracy;
    if (error <= 2 + accuracy + counts_per_ns_ * position.time_uncertainty_ns) {
      last_ = position;
      return;
    }
    ++tally.wrong;
    wrong_close += error <= 6 ? 1 : 0;
    if (!last_) return;
    const double elapsed = static_cast<double>(position.mono_ns - last_->mono_ns) + position.time_uncertainty_ns +
                           last_->time_uncertainty_ns;
    // 16: twice the accumulated pitch error, +-8 LSB (spec 5.4.1); with FS the accuracy is 5 bits.
    const bool coarse = ((position.flags | last_->flags) & position_t::FLAG_LOW_ACCURACY) != 0;
    const double tolerance = 18 + (coarse ? static_cast<double>(kCountsPerTurn) / 32 : 0);
    if (Distance(position, static_cast<double>(last_->counts)) > counts_per_ns_ * elapsed + tolerance) {
      ++tally.outside;
    }
  }

  // Without TURNS_VALID the whole turns are not claimed.
  static double Distance(const position_t& position, double from) {
    const double difference = static_cast<double>(position.counts) - from;
    if ((position.flags & position_t::FLAG_TURNS_VALID) != 0) return std::abs(difference);
    return std::abs(std::remainder(difference, static_cast<double>(kCountsPerTurn)));
  }

  const Shaft& shaft_;
  const double counts_per_ns_ = shaft_.max_rpm / 60 * static_cast<double>(kCountsPerTurn) * 1e-9;
  std::optional<position_t> last_;
};

struct Mode {
  const char* name;
  const Shaft& shaft;
  double bit_error_rate;
  double byte_fault_rate;
  bool garbage;
  // Shares of replies with another position that pass all static checks: without and with StatusAgrees; 0: not
  // predicted. Two flips cancel in the CRC when they hit one bit column. 122 such pairs hit no checked bit and
  // change the position, 98 of them leave SF and ALMC in agreement: pairs x p^2 (1-p)^86.
  double theory_passing;
  double theory_agreeing;
  double goal;  // share of replies that may be published valid and wrong; 0: none is set
};

constexpr std::array<Mode, 7> kModes = {
    {{"bit_flips_1e-3", kModelLimits, 1e-3, 0, false, 11'195e-8, 9'009e-8, 0},
     {"bit_flips_1e-2", kModelLimits, 1e-2, 0, false, 514'000e-8, 414'000e-8, 0},
     {"drops_doubles_inserts", kModelLimits, 0, 1e-2, false, 0, 0, 0},
     {"garbage", kModelLimits, 0, 1e-2, true, 0, 0, 0},
     {"all_together", kModelLimits, 1e-3, 1e-2, false, 0, 0, 0},
     {"real_axis_1e-3", kRealAxis, 1e-3, 0, false, 11'195e-8, 9'009e-8, 60e-8},
     {"real_axis_1e-2", kRealAxis, 1e-2, 0, false, 514'000e-8, 414'000e-8, 0}}};

struct Figures {
  std::int64_t exchanges = 0;
  std::int64_t static_wrong = 0;  // damaged, but passing every static check, with another position
  std::int64_t agreeing = 0;      // of these, with SF and ALMC in agreement
  std::int64_t close = 0;         // of those, within 4 counts
  std::int64_t good_doubted = 0;  // undamaged replies that were not believed
  std::int64_t blameless = 0;     // of these, with no damaged reply believed among the last ones
};

// So many readings after a damaged one that was believed may be doubted because of it.
constexpr std::int64_t kAftermath = 200;

class Campaign {
 public:
  Campaign(const MachineConfig& machine, const Mode& mode)
      : shaft_(mode.shaft),
        damage_(mode.bit_error_rate, mode.byte_fault_rate, mode.garbage),
        referee_(mode.shaft),
        axis_(machine.buses[0], referee_, now_) {}

  void Run(std::int64_t exchanges) {
    while (figures_.exchanges < exchanges) {
      axis_.Tick(now_);
      const Step step = axis_.device().Next({.now = now_, .poll_due = true});
      if (const auto* exchange = std::get_if<Exchange>(&step.action)) {
        axis_.device().OnStarted(step, now_);
        Answer(*exchange);
      } else if (const auto* silence = std::get_if<WaitForIdleLine>(&step.action)) {
        axis_.device().OnStarted(step, now_);
        now_ += silence->quiet;
        Tell(Event::Kind::kSilent, {}, {});
      } else if (const auto* idle = std::get_if<Idle>(&step.action)) {
        now_ = std::max(now_ + kMicrosecond, std::min(idle->until, now_ + 100 * kMillisecond));
      }
    }
  }

  [[nodiscard]] const Figures& figures() const { return figures_; }
  [[nodiscard]] const Referee& referee() const { return referee_; }
  [[nodiscard]] const DevicePublisher& channel() const { return axis_.channel(); }

 private:
  // Replies that came whole and were not believed: out of reach, or with bits that the document rules out.
  [[nodiscard]] std::int64_t Doubted() const {
    return axis_.channel().errors(ErrorKind::kImplausible) + axis_.channel().errors(ErrorKind::kRange);
  }

  void Answer(const Exchange& exchange) {
    ++figures_.exchanges;
    sent_ = {now_, now_ + 4 * kMicrosecond};
    // It latches as the request ends: 4 us after it began to be sent, and 3 us before the reply begins.
    TrueReply(shaft_, sent_.last, reply_);
    const std::int64_t truth = Position(reply_);
    const Reply undamaged = reply_;
    damage_.Apply(reply_);
    const std::int64_t doubted = Doubted();
    if (PassesStaticChecks(reply_) && Position(reply_) != truth) {
      ++figures_.static_wrong;
      if (StatusAgrees(reply_)) {
        ++figures_.agreeing;
        figures_.close += std::abs(Position(reply_) - truth) <= 4 ? 1 : 0;
      }
    }
    const Bytes bytes(reply_);
    const std::size_t length = exchange.reply_length(bytes);
    if (length == 0 || bytes.size() < length) {
      now_ += exchange.timeout;
      Tell(Event::Kind::kTimeout, exchange.request, bytes);
      return;
    }
    now_ += kExchangeTime;
    Tell(Event::Kind::kReply, exchange.request, bytes.first(length));
    const bool is_doubted = Doubted() != doubted;
    if (reply_ != undamaged && PassesStaticChecks(reply_) && !is_doubted) believed_at_ = figures_.exchanges;
    if (reply_ == undamaged && is_doubted) {
      ++figures_.good_doubted;
      figures_.blameless += figures_.exchanges - believed_at_ > kAftermath ? 1 : 0;
    }
    if (bytes.size() > length) Tell(Event::Kind::kUnexpectedBytes, {}, bytes.subspan(length));
  }

  void Tell(Event::Kind kind, Bytes request, Bytes bytes) {
    axis_.device().On({.kind = kind, .sent = sent_, .received = {now_, now_}, .request = request, .bytes = bytes});
  }

  MonoNs now_ = 10 * kSecond;
  const Shaft& shaft_;
  Interval sent_;
  std::int64_t believed_at_ = -kAftermath - 1;  // the last exchange whose damaged reply was believed
  Damage damage_;
  Referee referee_;
  DeviceUnderTest axis_;
  Figures figures_;
  Reply reply_;
};

bool AgreesWithShare(std::int64_t seen, double share, std::int64_t exchanges) {
  const double expected = share * static_cast<double>(exchanges);
  return expected == 0 ||
         std::abs(static_cast<double>(seen) - expected) <= 5 * std::sqrt(expected) + 0.02 * expected;
}

bool RunMode(const Mode& mode, std::int64_t exchanges) {
  const std::optional<MachineConfig> machine = CampaignMachine(mode.shaft.machine);
  if (!machine) return false;
  Campaign campaign(*machine, mode);
  campaign.Run(exchanges);
  const Figures& figures = campaign.figures();
  const Tally& tally = campaign.referee().tally;
  std::printf("%s\n  replies %lld; published valid %lld, withheld %lld\n", mode.name, Long{figures.exchanges},
              Long{tally.valid}, Long{tally.withheld});
  std::printf("  published valid and wrong: outside the bound %lld, inside it %lld (within 4 counts %lld)\n",
              Long{tally.outside}, Long{tally.wrong - tally.outside}, Long{campaign.referee().wrong_close});
  const auto per = [&](double share) { return share * static_cast<double>(figures.exchanges); };
  std::printf(
      "  wrong, passing the checks of one frame: %lld (theory %.0f); with SF and ALMC agreeing: %lld "
      "(theory %.0f), of these within 4 counts %lld\n",
      Long{figures.static_wrong}, per(mode.theory_passing), Long{figures.agreeing}, per(mode.theory_agreeing),
      Long{figures.close});
  std::printf("  undamaged replies that were doubted: %lld, of these with no damaged one believed before %lld\n",
              Long{figures.good_doubted}, Long{figures.blameless});
  PrintErrors(campaign.channel());
  const bool in_goal =
      mode.goal == 0 || (static_cast<double>(tally.wrong) <= per(mode.goal) + 3 && figures.blameless == 0);
  const bool useful = tally.valid > figures.exchanges / 4 && tally.wrong <= figures.static_wrong;
  return tally.outside == 0 && useful && in_goal &&
         AgreesWithShare(figures.static_wrong, mode.theory_passing, figures.exchanges) &&
         AgreesWithShare(figures.agreeing, mode.theory_agreeing, figures.exchanges);
}

}  // namespace
}  // namespace axlecast

int main(int argc, char** argv) {
  return axlecast::CampaignMain(argc, argv, "corrupted_replies EXCHANGES [MODE...]",
                                "no position outside the bound was published valid", axlecast::kModes,
                                axlecast::RunMode);
}
