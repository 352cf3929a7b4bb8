// The messages of many machines from one process, for tests of a fleet (tests/fleet): whole drivers for 200 axes do not fit on a host with
// two cores. Each machine has two ports of its own. What was sent is counted and printed, so that a database can be compared with it.
//
// fleet_machines MACHINES AXES RATE SECONDS FIRST_PORT PREFIX
//
// Machine i (from 1) is named PREFIX followed by two digits and sends to udpm://239.255.77.1:FIRST_PORT+2i (data) and +2i+1 (commands).
// RATE: positions of each axis in a second. SECONDS: 0: until SIGTERM. Prints one JSON object at the end. Alarms appear and
// clear, commands end, and trips are read at fixed intervals, so that there are some of each in a minute.

#include <axlecast/alarm_t.hpp>
#include <axlecast/command_status_t.hpp>
#include <axlecast/position_t.hpp>
#include <axlecast/trip_log_t.hpp>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "core/base/text.h"
#include "core/messages/lcm_url.h"
#include "core/messages/message.h"
#include "core/messages/origin.h"
#include "platform/net/group_sender.h"
#include "platform/os/system_clock.h"

namespace axlecast {
namespace {

constexpr int kAlarmPeriod = 20;   // s; an alarm is present for half of it
constexpr int kCommandPeriod = 7;  // s
constexpr int kTripPeriod = 15;    // s
constexpr std::int64_t kTurn = 1 << 20;
constexpr std::int32_t kFlags =
    int{position_t::FLAG_VALID} | int{position_t::FLAG_TURNS_VALID} | int{position_t::FLAG_SIMULATED};

volatile std::sig_atomic_t stop = 0;

struct Arguments {
  int machines;
  int axes;
  int rate;
  int seconds;
  int first_port;
  std::string prefix;
};

// One axis: its sequence numbers and its counts of what was sent.
struct Axis {
  std::string name;
  std::int64_t positions = 0;
  std::int64_t alarm_messages = 0;
  std::int64_t alarms_appeared = 0;
  std::int64_t alarms_cleared = 0;
  std::int64_t trips = 0;
  std::int64_t alarm_since = 0;  // us, UNIX time; 0: not present
};

class Machine {
 public:
  Machine(const Arguments& arguments, int number, std::int64_t boot_id)
      : name_(arguments.prefix + (number < 10 ? "0" : "") + std::to_string(number)),
        data_(*ParseLcmUrl(Url(arguments.first_port + 2 * number))),
        commands_(*ParseLcmUrl(Url(arguments.first_port + 2 * number + 1))) {
    origin_.boot_id = boot_id;
    origin_.machine_id = NameHash(name_);
    origin_.clock_id = 1;
    origin_.machine = name_;
    for (int axis = 1; axis <= arguments.axes; ++axis) axes_.push_back({.name = "axis" + std::to_string(axis)});
  }

  // Sends position `tick` of every axis.
  void SendPositions(std::int64_t tick, int rate, std::int64_t utime, MonoNs now) {
    for (std::size_t i = 0; i < axes_.size(); ++i) SendPosition(i, tick, rate, utime, now);
  }

  // Sends what is due once a second. `second` counts from 0.
  void SendSecond(std::int64_t second, std::int64_t utime, MonoNs now) {
    for (std::size_t i = 0; i < axes_.size(); ++i) {
      SendAlarms(axes_[i], (second + static_cast<std::int64_t>(3 * i)) % kAlarmPeriod < kAlarmPeriod / 2, utime,
                 now);
    }
    if (second % kCommandPeriod == 1) SendOutcome(utime, now);
    if (second % kTripPeriod == 2)
      SendTrip(axes_[static_cast<std::size_t>(second / kTripPeriod) % axes_.size()], utime, now);
  }

  // Clears what is present, so that each alarm that appeared has an end.
  void End(std::int64_t utime, MonoNs now) {
    for (Axis& axis : axes_) SendAlarms(axis, false, utime, now);
  }

  [[nodiscard]] nlohmann::ordered_json Truth() const {
    nlohmann::ordered_json truth = {
        {"machine", name_}, {"boot_id", origin_.boot_id}, {"commands", commands_sent_}, {"failed", failed_}};
    for (const Axis& axis : axes_) {
      truth["axes"][axis.name] = {{"positions", axis.positions},
                                  {"alarm_messages", axis.alarm_messages},
                                  {"appeared", axis.alarms_appeared},
                                  {"cleared", axis.alarms_cleared},
                                  {"trips", axis.trips}};
    }
    return truth;
  }

 private:
  [[nodiscard]] static std::string Url(int port) {
    return "udpm://239.255.77.1:" + std::to_string(port) + "?ttl=0&interface=lo";
  }

  template <typename Message>
  void Send(GroupSender& port, const std::string& channel, Message& message, std::int64_t utime, MonoNs now) {
    message.utime = utime;
    message.mono_ns = now;
    origin_.Set(message);
    const std::vector<std::uint8_t> bytes = Encoded(message);
    if (!port.Send(channel, bytes)) ++failed_;
  }

  void SendPosition(std::size_t index, std::int64_t tick, int rate, std::int64_t utime, MonoNs now) {
    Axis& axis = axes_[index];
    position_t position{};
    position.seq = axis.positions++;
    // Seven of ten axes move; the others rest, with a noise of one count.
    const double t = static_cast<double>(tick) / rate;
    const double turns = index % 10 < 7 ? (2.0 + static_cast<double>(index)) *
                                              std::sin(t * (0.2 + 0.05 * static_cast<double>(index)))
                                        : 0.0;
    position.counts =
        static_cast<std::int64_t>(turns * static_cast<double>(kTurn)) + (index % 10 < 7 ? 0 : tick % 7 / 6);
    position.counts_per_turn = kTurn;
    position.raw_counts = ((position.counts % kTurn) + kTurn) % kTurn;
    position.raw_turns = static_cast<std::int32_t>((position.counts - position.raw_counts) / kTurn);
    position.angle_rad =
        static_cast<double>(position.raw_counts) * 2 * std::numbers::pi / static_cast<double>(kTurn);
    position.unit = position_t::UNIT_TURN;
    position.value = static_cast<double>(position.counts) / static_cast<double>(kTurn);
    position.speed_rad_s = std::numeric_limits<double>::quiet_NaN();
    position.time_uncertainty_ns = 20'000 + static_cast<std::int32_t>(tick % 97);
    position.tick = -1;
    position.flags = kFlags;
    Send(data_, "POSITION/" + axis.name, position, utime, now);
  }

  void SendAlarms(Axis& axis, bool present, std::int64_t utime, MonoNs now) {
    alarm_t alarm{};
    alarm.seq = axis.alarm_messages++;
    alarm.device = axis.name;
    if (present && axis.alarm_since == 0) {
      axis.alarm_since = utime;
      ++axis.alarms_appeared;
    }
    if (!present && axis.alarm_since != 0) {
      axis.alarm_since = 0;
      ++axis.alarms_cleared;
    }
    alarm.revision = axis.alarms_appeared + axis.alarms_cleared;
    if (present) {
      alarm_entry_t entry{};
      entry.code = 21;
      entry.source = alarm_entry_t::SOURCE_DEVICE;
      entry.severity = alarm_entry_t::SEVERITY_WARNING;
      entry.state = alarm_entry_t::STATE_LIVE;
      entry.first_utime = axis.alarm_since;
      entry.last_utime = utime;
      entry.count = static_cast<std::int32_t>(axis.alarms_appeared);
      entry.name = "battery_alarm";
      entry.action = "Exchange the battery.";
      alarm.entries.push_back(entry);
      alarm.n = 1;
      alarm.total = 1;
    }
    Send(data_, "ALARM/" + axis.name, alarm, utime, now);
  }

  void SendOutcome(std::int64_t utime, MonoNs now) {
    command_status_t status{};
    status.seq = commands_sent_++;
    for (std::size_t i = 0; i < 8; ++i) {
      status.id[i] = static_cast<std::uint8_t>(origin_.boot_id >> (8 * i));
      status.id[8 + i] = static_cast<std::uint8_t>(status.seq >> (8 * i));
    }
    status.device = axes_.front().name;
    status.operation = "clear_errors";
    status.state = command_status_t::STATE_SUCCEEDED;
    status.is_final = 1;
    status.verified = 1;
    status.text = "The errors are cleared.";
    status.started_utime = utime - 1'000;
    status.finished_utime = utime;
    status.epoch_after = -1;
    Send(commands_, "COMMAND_STATUS", status, utime, now);
  }

  void SendTrip(Axis& axis, std::int64_t utime, MonoNs now) {
    trip_log_t trip{};
    trip.seq = axis.trips++;
    trip.device = axis.name;
    trip.log_index = 1;
    trip.trip_count = static_cast<std::int32_t>(axis.trips);
    trip.factor_bits = 1;
    trip.not_before_utime = utime - 1'000'000;
    trip.not_after_utime = utime;
    trip.interval_us = 10'000;
    trip.valid_mask = 1;
    for (int sample = 0; sample < 20; ++sample) trip.samples[0][sample] = static_cast<float>(200 + sample);
    Send(data_, "TRIP/" + axis.name, trip, utime, now);
  }

  std::string name_;
  GroupSender data_;
  GroupSender commands_;
  Origin origin_;
  std::vector<Axis> axes_;
  std::int64_t commands_sent_ = 0;
  std::int64_t failed_ = 0;
};

int Run(const Arguments& arguments) {
  const SystemClock clock;
  std::mt19937_64 random(std::random_device{}());
  std::deque<Machine> machines;
  for (int number = 1; number <= arguments.machines; ++number) {
    machines.emplace_back(arguments, number, static_cast<std::int64_t>(random() >> 1U));
  }
  std::signal(SIGTERM, [](int) { stop = 1; });
  std::signal(SIGINT, [](int) { stop = 1; });

  const MonoNs interval = kSecond / arguments.rate;
  const MonoNs begin = clock.Now();
  const std::int64_t ticks = arguments.seconds == 0 ? INT64_MAX : std::int64_t{arguments.seconds} * arguments.rate;
  MonoNs latest = 0;
  for (std::int64_t tick = 0; tick < ticks && stop == 0; ++tick) {
    static_cast<void>(PollUntil({}, begin + tick * interval, clock));
    latest = std::max(latest, clock.Now() - begin - tick * interval);
    for (Machine& machine : machines) {
      machine.SendPositions(tick, arguments.rate, clock.UtcMicroseconds(), clock.Now());
      if (tick % arguments.rate == 0)
        machine.SendSecond(tick / arguments.rate, clock.UtcMicroseconds(), clock.Now());
    }
  }
  nlohmann::ordered_json truth = {{"seconds", static_cast<double>(clock.Now() - begin) / kSecond},
                                  {"latest_ms", latest / kMillisecond}};
  for (Machine& machine : machines) {
    machine.End(clock.UtcMicroseconds(), clock.Now());
    truth["machines"].push_back(machine.Truth());
  }
  std::puts(truth.dump().c_str());
  return 0;
}

}  // namespace
}  // namespace axlecast

int main(int argc, char** argv) {
  if (argc != 7) {
    std::fputs("usage: fleet_machines MACHINES AXES RATE SECONDS FIRST_PORT PREFIX\n", stderr);
    return 2;
  }
  return axlecast::Run({.machines = std::atoi(argv[1]),
                        .axes = std::atoi(argv[2]),
                        .rate = std::atoi(argv[3]),
                        .seconds = std::atoi(argv[4]),
                        .first_port = std::atoi(argv[5]),
                        .prefix = argv[6]});
}
