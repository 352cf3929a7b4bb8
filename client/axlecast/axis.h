// One object for an axis of a control process: its position, its permits and its commands. docs/control_process.md.
//
//   axlecast::ConnectionSettings settings;
//   settings.machine = "press1";
//   axlecast::Connection connection(settings);
//   if (!connection.state()) ... connection.state().error().text
//   axlecast::Axis axis(connection, "axis1");
//   ... in the control loop:
//   if (const auto position = axis.At(connection.Now())) use(position.position.value);
//   else hold(position.reason);
//
// C++17. Link axlecast_client. axlecast.h is the same for C.
#pragma once

#include <axlecast/command_client.h>
#include <axlecast/permit_issuer.h>
#include <axlecast/position_tracker.h>
#include <axlecast/time_base.h>

#include <axlecast/position_set_t.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace axlecast {
inline namespace control {

struct ConnectionSettings {
  std::string data_url = "udpm://239.255.76.67:7667?ttl=0";     // as `lcm.url` of the machine's file
  std::string command_url = "udpm://239.255.76.67:7668?ttl=0";  // as `lcm.command_url`
  std::string prefix = {};                                      // as `lcm.prefix`
  std::string machine = {};     // its name: messages of other machines are ignored. Empty: those of all are taken
  std::string bridge_key = {};  // as ClientSettings::bridge_key
  struct Key {                  // of a file, or a systemd credential; neither: unsigned
    std::string file = {};
    std::string credential = {};
  };
  std::optional<Key> commands = {};  // signs commands; nothing: this connection sends none
  std::optional<Key> permits = {};   // of role control, signs permits; nothing: this connection issues none
};

// The channels of a machine, for any number of axes. Every method may be called from any thread, and none throws. One thread
// of its own receives; a call waits for it at most while it handles one message, and its priority is raised meanwhile.
class Connection {
 public:
  // Takes up to 3 s where multicast does not work; see state().
  explicit Connection(const ConnectionSettings& settings);
  // Axes and sets of the connection may exist longer. They then answer with what was received.
  ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  // Fails if a part that the settings ask for does not work: the error is the cause and the fix.
  [[nodiscard]] Result<> state() const;

  // CLOCK_MONOTONIC of this host, in ns.
  [[nodiscard]] static std::int64_t Now();
  // Returns the instant of the time base at `mono_ns` on the clock of this host.
  [[nodiscard]] TimeBase::Instant OnBase(std::int64_t mono_ns) const;
  // Commands of any device; null without ConnectionSettings::commands.
  [[nodiscard]] CommandClient* commands();

  struct State;

 private:
  friend class Axis;
  friend class PositionSet;
  std::shared_ptr<State> state_;
};

// A position at one instant. It converts to true only if it may be used.
struct AxisPosition {
  PositionTracker::Position position;
  PositionTracker::Freshness freshness = PositionTracker::Freshness::kNoReading;  // of the newest reading, now
  std::int64_t mono_ns = 0;  // the instant that the position is for, on the clock of this host
  std::int64_t age_ns = -1;  // of the newest valid reading, now; negative: no reading yet
  TimeBase::Instant base;    // the same instant on the time base, with the uncertainty of the reading
  position_t newest{};       // the newest message: unit, speed, device status
  const char* reason = "";   // why there is no position; never freed

  explicit operator bool() const { return static_cast<bool>(position); }
};

// Every method may be called from any thread, and none throws. It may exist longer than its connection.
class Axis {
 public:
  struct Options {
    // As in PositionTracker::Options.
    std::int64_t max_age_ns = 0;
    std::int64_t max_extrapolation_ns = -1;
    std::int64_t max_gap_ns = -1;
    std::int64_t max_time_half_width_ns = 0;  // 0: readings of other hosts are not used
  };

  Axis(Connection& connection, std::string device, const Options& options);
  Axis(Connection& connection, std::string device) : Axis(connection, std::move(device), Options()) {}
  ~Axis();
  Axis(const Axis&) = delete;
  Axis& operator=(const Axis&) = delete;

  // Returns the newest reading, at its own instant. There is a position if it is fresh.
  [[nodiscard]] AxisPosition Latest() const;
  // Returns the position at an instant between two readings or shortly after the newest one.
  [[nodiscard]] AxisPosition At(std::int64_t mono_ns) const;
  [[nodiscard]] PositionTracker::Totals totals() const;

  // As PermitIssuer; false without ConnectionSettings::permits. Permits state their instant on the time base if it is known.
  [[nodiscard]] Result<> permits_state() const;
  bool Allow(const std::vector<std::string>& operations, std::int32_t valid_ms);
  bool Withdraw();

  // As CommandClient, for this device. Without ConnectionSettings::commands, every command is kNotAccepted.
  [[nodiscard]] Result<> commands_state() const;
  CommandId Send(CommandRequest request);
  [[nodiscard]] CommandResult Await(const CommandId& id, std::int64_t timeout_ms);
  void Cancel(const CommandId& id);
  [[nodiscard]] CommandResult Query(const CommandId& id, std::int64_t timeout_ms);

 private:
  struct State;
  std::shared_ptr<Connection::State> connection_;
  std::shared_ptr<State> state_;
};

// The readings of several axes on one tick: POSITION_SET/<set>. Every method may be called from any thread, and none throws.
class PositionSet {
 public:
  PositionSet(Connection& connection, const std::string& name);
  ~PositionSet();
  PositionSet(const PositionSet&) = delete;
  PositionSet& operator=(const PositionSet&) = delete;

  struct Reading {
    position_set_t set{};
    std::int64_t received_ns = 0;  // on CLOCK_MONOTONIC of this host
    std::int64_t lost = 0;         // sets that were lost on their way since this object exists
  };
  // Returns the newest set, whatever its state; nothing if none has arrived.
  [[nodiscard]] std::optional<Reading> Newest() const;

 private:
  struct State;
  std::shared_ptr<Connection::State> connection_;
  std::shared_ptr<State> state_;
};

}  // namespace control
}  // namespace axlecast
