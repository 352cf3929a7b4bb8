// Prints the position of one device ten times a second: print_position axis1 [LCM_URL [MICROSECONDS]]
//
// MICROSECONDS: a reading of another host is used if its instant is known to +- this. 0: only readings of this host are used.
//
// The whole of what a consumer needs: lcm-cpp, the generated messages and axlecast/position_tracker.h.
#include <time.h>

#include <axlecast/position_tracker.h>
#include <axlecast/time_base.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <lcm/lcm-cpp.hpp>
#include <string>

namespace {

using axlecast::PositionTracker;
using Freshness = PositionTracker::Freshness;

std::int64_t MonotonicNs() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

struct Axis {
  explicit Axis(std::int64_t microseconds) : tracker(Options(microseconds)) {}

  PositionTracker::Options Options(std::int64_t microseconds) const {
    PositionTracker::Options options;
    if (microseconds > 0) options.time = &time;
    options.max_time_half_width_ns = microseconds * 1'000;
    return options;
  }
  void OnPosition(const lcm::ReceiveBuffer*, const std::string&, const axlecast::position_t* message) {
    const auto news = tracker.OnPosition(*message, MonotonicNs());
    if (news.restarted) std::printf("the driver was restarted\n");
    if (news.datum_changed) std::printf("the datum changed: epoch %d\n", message->datum_epoch);
  }
  void OnDevice(const lcm::ReceiveBuffer*, const std::string&, const axlecast::device_info_t* message) {
    tracker.OnDevice(*message);
  }
  void OnTime(const lcm::ReceiveBuffer*, const std::string&, const axlecast::time_quality_t* message) {
    time.OnTime(*message, MonotonicNs());
  }
  axlecast::TimeBase time;
  PositionTracker tracker;
};

void Print(const PositionTracker& tracker) {
  const std::int64_t now = MonotonicNs();
  const Freshness freshness = tracker.Check(now);
  if (freshness != Freshness::kFresh) {
    std::printf("no position: %s\n", axlecast::ReasonText(freshness));
    return;
  }
  const auto position = tracker.At(now);
  if (!position) {
    std::printf("no position: %s\n", axlecast::ReasonText(position.answer));
    return;
  }
  const bool referenced = (position.flags & axlecast::position_t::FLAG_REFERENCED) != 0;
  std::printf("%14.4f  %.1f ms old  %lld lost%s\n", position.value, static_cast<double>(tracker.AgeNs(now)) * 1e-6,
              static_cast<long long>(tracker.totals().lost), referenced ? "" : "  not referenced");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: print_position DEVICE [LCM_URL [MICROSECONDS]]\n");
    return 2;
  }
  const std::string device = argv[1];
  lcm::LCM lcm(argc > 2 ? argv[2] : "udpm://239.255.76.67:7667?ttl=0");
  if (!lcm.good()) {
    std::fprintf(stderr, "LCM does not start: is there a multicast route? (ip route add 224.0.0.0/4 dev lo)\n");
    return 1;
  }
  Axis axis(argc > 3 ? std::atoll(argv[3]) : 0);
  lcm.subscribe("POSITION/" + device, &Axis::OnPosition, &axis);
  lcm.subscribe("DEVICE/" + device, &Axis::OnDevice, &axis);
  lcm.subscribe("TIME/.*", &Axis::OnTime, &axis);
  constexpr std::int64_t kPeriod = 100'000'000;
  for (std::int64_t next = MonotonicNs() + kPeriod;;) {
    const std::int64_t wait_ms = (next - MonotonicNs()) / 1'000'000;
    if (wait_ms > 0 && lcm.handleTimeout(static_cast<int>(wait_ms)) < 0) return 1;
    if (MonotonicNs() < next) continue;
    Print(axis.tracker);
    std::fflush(stdout);
    next += kPeriod;
  }
}
