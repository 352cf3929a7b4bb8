#include "tests/time_guests/tick_judge.h"

#include <axlecast/position_sets.h>
#include <axlecast/time_base.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <utility>

namespace axlecast {
namespace {

class TickJudge {
 public:
  // `at`: the guest in which the sets arrive.
  TickJudge(const GuestRun& run, double shift, const Guest& at, std::string maker)
      : run_(run), shift_(shift), at_(at), maker_(std::move(maker)) {
    for (const Guest& guest : run.guests) {
      for (const Guest::Position& each : guest.positions) {
        counts_per_turn_[each.device] = each.position.counts_per_turn;
      }
    }
  }

  // `received`: CLOCK_MONOTONIC of that guest. Ignored outside of the readings of its clocks.
  void OnSet(const position_set_t& set, MonoNs received) {
    const std::optional<Bounds> ticks = at_.clocks.When(ClockLog::Clock::kMono, received);
    if (!ticks) return;
    const std::optional<Bounds> time = run_.host.At(ClockLog::Clock::kMono, GuestRun::OnHost(at_, *ticks));
    if (!time) return;
    TickFigures& figures = FiguresOf(run_.PhaseAt(time->lowest));
    ++figures.ticks;
    if (set.state == position_set_t::STATE_INCOMPLETE) {
      ++figures.incomplete;
    } else {
      JudgeComplete(Moved(set, shift_), figures);
    }
  }

  [[nodiscard]] const std::vector<TickFigures>& figures() const { return figures_; }

 private:
  TickFigures& FiguresOf(const std::string& phase) {
    const auto found = std::find_if(figures_.begin(), figures_.end(),
                                    [&](const TickFigures& figures) { return figures.phase == phase; });
    if (found != figures_.end()) return *found;
    figures_.push_back({});
    figures_.back().maker = maker_;
    figures_.back().phase = phase;
    return figures_.back();
  }

  void JudgeComplete(const position_set_t& set, TickFigures& figures) const {
    Verdict worst = Verdict::kHolds;
    Bounds middles = {INT64_MAX, INT64_MIN};  // of the bounds of the true instants
    const std::int64_t hull = set.latest_ns - set.earliest_ns;
    for (const position_set_axis_t& axis : set.axes) {
      const std::optional<Bounds> truth = SampledAt(axis, set.base_id);
      if (!truth) return figures.judged.Count(Verdict::kUnjudged);
      const std::int64_t stated = set.tick_ns + axis.offset_ns;
      worst = Worse(worst, JudgeInterval(truth, stated, axis.half_width_ns));
      worst = Worse(worst, JudgeInterval(truth, set.earliest_ns + hull / 2, hull - hull / 2));
      const std::int64_t middle = truth->lowest + (truth->highest - truth->lowest) / 2;
      middles = {std::min(middles.lowest, middle), std::max(middles.highest, middle)};
      figures.from_middles.push_back(std::abs(middle - stated));
      figures.oracle_error = std::max(figures.oracle_error, truth->highest - truth->lowest);
    }
    figures.judged.Count(worst);
    figures.spreads.push_back(middles.highest - middles.lowest);
    figures.hulls.push_back(hull);
  }

  [[nodiscard]] static Verdict Worse(Verdict a, Verdict b) {
    if (a == Verdict::kMisses || b == Verdict::kMisses) return Verdict::kMisses;
    return a == Verdict::kHolds ? b : a;
  }

  // Returns the instant of the base at which the shaft had the position that was published.
  [[nodiscard]] std::optional<Bounds> SampledAt(const position_set_axis_t& axis, std::int64_t base_id) const {
    const auto counts_per_turn = counts_per_turn_.find(axis.device);
    if (counts_per_turn == counts_per_turn_.end()) return std::nullopt;
    for (const Guest& guest : run_.guests) {
      const auto shaft = guest.shafts.find(axis.device);
      if (shaft == guest.shafts.end()) continue;
      const auto mono = shaft->second.When(axis.counts, counts_per_turn->second);
      if (!mono) return std::nullopt;
      const auto first = guest.clocks.When(ClockLog::Clock::kMono, mono->lowest);
      const auto last = guest.clocks.When(ClockLog::Clock::kMono, mono->highest);
      if (!first || !last) return std::nullopt;
      return run_.BaseAt(base_id, GuestRun::OnHost(guest, {first->lowest, last->highest}));
    }
    return std::nullopt;
  }

  const GuestRun& run_;
  double shift_;
  const Guest& at_;
  std::string maker_;
  std::map<std::string, std::int64_t> counts_per_turn_;  // of each axis
  std::vector<TickFigures> figures_;
};

// A consumer in a guest: passes each message on as it arrived, and takes every set.
class Consumer {
 public:
  // `like`: the set of the machine file, as it was published.
  Consumer(const Guest& guest, const position_set_t& like) : guest_(guest), builder_(OptionsFor(like)) {
    for (std::size_t i = 0; i < like.axes.size(); ++i) axes_[like.axes[i].device] = i;
  }

  template <typename Use>
  void Run(const Use& use) {
    auto message = guest_.messages.begin();
    for (const Guest::Position& position : guest_.positions) {
      for (; message != guest_.messages.end() && message->received <= position.received; ++message) {
        time_.OnTime(message->time, message->received);
      }
      const auto axis = axes_.find(position.device);
      if (axis == axes_.end()) continue;
      builder_.OnPosition(axis->second, position.position, position.received);
      while (const position_set_t* set = builder_.Next(position.received)) use(*set, position.received);
    }
  }

 private:
  [[nodiscard]] PositionSetBuilder::Options OptionsFor(const position_set_t& like) const {
    PositionSetBuilder::Options options;
    options.name = like.set;
    for (const position_set_axis_t& axis : like.axes) options.axes.push_back({.device = axis.device});
    options.period_ns = like.period_ns;
    options.phase_ns = like.tick_ns - like.tick * like.period_ns;
    options.limit_ns = like.limit_ns;
    options.one_host = false;
    options.time = &time_;
    return options;
  }

  const Guest& guest_;
  TimeBase time_;
  PositionSetBuilder builder_;
  std::map<std::string, std::size_t> axes_;
};

}  // namespace

position_set_t Moved(position_set_t set, double half_widths) {
  if (half_widths == 0) return set;
  set.earliest_ns = INT64_MAX;
  set.latest_ns = INT64_MIN;
  for (position_set_axis_t& axis : set.axes) {
    axis.offset_ns += static_cast<std::int32_t>(std::lround(half_widths * axis.half_width_ns));
    const std::int64_t middle = set.tick_ns + axis.offset_ns;
    set.earliest_ns = std::min(set.earliest_ns, middle - axis.half_width_ns);
    set.latest_ns = std::max(set.latest_ns, middle + axis.half_width_ns);
  }
  return set;
}

std::vector<TickFigures> JudgeTicks(const GuestRun& run, double shift) {
  std::vector<TickFigures> all;
  const auto take = [&](const TickJudge& judge) {
    all.insert(all.end(), judge.figures().begin(), judge.figures().end());
  };
  const auto publisher = std::max_element(run.guests.begin(), run.guests.end(), [](const Guest& a, const Guest& b) {
    return a.sets.size() < b.sets.size();
  });
  if (publisher == run.guests.end() || publisher->sets.empty()) return all;
  TickJudge published(run, shift, *publisher, "axlecast sets");
  for (const Guest::Set& each : publisher->sets) published.OnSet(each.set, each.received);
  take(published);
  for (const Guest& guest : run.guests) {
    if (guest.positions.empty()) continue;
    TickJudge judge(run, shift, guest, "a consumer in " + guest.name);
    Consumer(guest, publisher->sets.front().set).Run([&](const position_set_t& set, MonoNs received) {
      judge.OnSet(set, received);
    });
    take(judge);
  }
  return all;
}

bool IsTrue(const std::vector<TickFigures>& figures, std::int64_t least) {
  std::map<std::string, std::int64_t> true_ones;
  for (const TickFigures& each : figures) {
    if (each.judged.misses > 0) return false;
    true_ones[each.maker] += each.judged.holds;
  }
  return !figures.empty() &&
         std::all_of(true_ones.begin(), true_ones.end(), [&](const auto& each) { return each.second >= least; });
}

}  // namespace axlecast
