#include <gtest/gtest.h>

#include <axlecast/device_info_t.hpp>

#include <memory>
#include <optional>
#include <random>
#include <vector>

#include "bridge/dispatch/dispatcher.h"
#include "bridge/store/memory_store_fixture.h"
#include "core/command/commands.h"
#include "core/messages/enum_names.h"
#include "core/messages/message.h"
#include "drivers/runtime/command/operations.h"
#include "tests/command_simulation/faults.h"
#include "tests/command_simulation/network.h"
#include "tests/support/counting_family.h"
#include "tests/support/polled_device.h"
#include "tests/support/polled_family.h"

namespace axlecast {
namespace {

using S = command_status_t;

constexpr AlarmSpec kBattery = {6, alarm_entry_t::SOURCE_DEVICE, alarm_entry_t::SEVERITY_ERROR, "battery_error",
                                ""};

// A driver process whose device has the alarm all the time.
class AlarmedDriver {
 public:
  AlarmedDriver(const BusConfig& bus, std::int64_t boot_id, WorldNetwork& network, const WorldClock& clock)
      : clock_(clock), network_(network), boot_id_(boot_id), bus_(bus) {
    time_.Update(clock.Now(), clock.UtcMicroseconds());
    operations_.Add(bus.devices[0], channel_, device_);
    channel_.OnAlarm(kBattery, AlarmState::kLive, clock.Now());
  }
  void OnCommand(Bytes message) { desk_.OnDriverCommand(message); }
  void Step() {
    operations_.Poll(clock_.Now());
    if (clock_.Now() < next_hello_) return;
    next_hello_ = clock_.Now() + 100 * kMillisecond;
    std::vector<driver_device_t> devices(1);
    devices[0].device = "axis1";
    devices[0].state = device_info_t::STATE_ONLINE;
    desk_.Hello(devices);
    if (channel_.alarms().acknowledged_revision() > 0) {
      desk_.PublishAcknowledged("axis1", channel_.alarms().Acknowledged());
    }
  }
  [[nodiscard]] const AlarmTable& alarms() const { return channel_.alarms(); }

 private:
  const WorldClock& clock_;
  WorldNetwork& network_;
  const std::int64_t boot_id_;
  const BusConfig& bus_;
  Timebase time_;
  DriverCommandServer desk_{
      bus_,
      UnsignedBridge(),
      {.origin = {.boot_id = boot_id_}, .clock = &clock_, .sink = &network_, .wake = [] {}, .key = nullptr}};
  Operations operations_{PolledFamily(), desk_, time_, [](LogLevel, std::string_view) {}};
  DevicePublisher channel_{
      bus_,
      bus_.devices[0],
      {.origin = {.boot_id = boot_id_},
       .time = &time_,
       .sink = &network_,
       .on_outcome = [this](const std::string& device, const CommandId& id, const Outcome& outcome) {
         operations_.OnOutcome(device, id, outcome);
       }}};
  PolledDevice device_{0, channel_};
  MonoNs next_hello_ = 0;
};

// One command about the alarm; the bridge is killed at one of its transitions and started again.
class AlarmKills {
 public:
  explicit AlarmKills(std::int64_t kill_at) {
    machine_.machine = "world";
    machine_.bridge.allow_unsigned = true;
    machine_.buses = {PolledBus(1)};
    RestartDriver();
    StartBridge();
    Pass(2 * DuplicateBridgeDetector::kListen);
    faults_.KillAt(kill_at < 0 ? kill_at : faults_.count() + kill_at);
    first_ = faults_.count();
  }

  // Repeats the command as a client does, until the journal has its outcome.
  [[nodiscard]] bool Do(const std::string& operation, std::vector<argument_t> arguments) {
    command_body_t body{};
    body.id[0] = 1;
    body.valid_ms = 60'000;
    body.device = "axis1";
    body.operation = operation;
    body.expect_epoch = -1;
    body.arguments = std::move(arguments);
    body.n_arguments = static_cast<std::int8_t>(body.arguments.size());
    body.issued_mono_ns = clock_.now;
    body.bridge_boot_id = boots_;
    for (int i = 0; i < 200 && !Outcome(); ++i) {
      // A command that no bridge has accepted is created again for the next bridge.
      if (!store_.Find(IdOf(body.id))) body.bridge_boot_id = boots_;
      command_t envelope{};
      envelope.body = Encoded(body);
      envelope.body_size = static_cast<std::int16_t>(envelope.body.size());
      network_.Publish("COMMAND", Encoded(envelope));
      Pass(50 * kMillisecond);
    }
    return Outcome().has_value();
  }
  [[nodiscard]] std::optional<S> Outcome() const {
    CommandId id{};
    id[0] = 1;
    const auto status = store_.Find(id);
    return status && status->is_final != 0 ? status : std::nullopt;
  }
  void RestartDriver() {
    driver_ = std::make_unique<AlarmedDriver>(machine_.buses[0], ++driver_boots_, network_, clock_);
  }
  void Pass(MonoNs time) {
    for (const MonoNs end = clock_.now + time; clock_.now < end;) Step();
  }
  [[nodiscard]] const AlarmTable& alarms() const { return driver_->alarms(); }
  [[nodiscard]] std::vector<AlarmMark> Marks() const { return store_.Marks("axis1"); }
  [[nodiscard]] std::int64_t transitions() const { return faults_.count() - first_; }
  [[nodiscard]] std::int64_t bridges() const { return boots_ - kFirstBoot; }

 private:
  static constexpr std::int64_t kFirstBoot = 41;

  void StartBridge() {
    journal_ = std::make_unique<InlineJournal>(faulty_store_);
    const BridgePorts ports{.journal = journal_.get(),
                            .commands = &faulty_sink_,
                            .data = &network_,
                            .key = nullptr,
                            .log = [](const std::string&) {},
                            .random = [] { return CommandId{}; }};
    Alive([&] { bridge_ = std::make_unique<Dispatcher>(machine_, Origin{.boot_id = ++boots_}, ports, Now()); });
  }
  template <typename Work>
  void Alive(const Work& work) {
    try {
      work();
    } catch (const Killed&) {
      bridge_.reset();
    }
  }
  void Step() {
    clock_.now += 10 * kMillisecond;
    network_.Deliver([this](const std::string& channel, Bytes message) {
      if (channel == "DRIVER_COMMAND/rs485-0") return driver_->OnCommand(message);
      if (!bridge_) return;
      if (channel == "COMMAND") Alive([&] { bridge_->OnCommand(message, Now()); });
      if (channel.starts_with("DRIVER_STATUS/")) Alive([&] { bridge_->OnDriverStatus(channel, message, Now()); });
    });
    driver_->Step();
    if (bridge_) Alive([&] { bridge_->Tick(Now()); });
    if (!bridge_) StartBridge();
  }
  [[nodiscard]] Timestamp Now() const { return {clock_.now, clock_.UtcMicroseconds()}; }

  std::mt19937 random_{1};
  WorldClock clock_;
  WorldNetwork network_{{}, clock_, random_};
  MachineConfig machine_;
  MemoryStore store_;
  Faults faults_;
  FaultyStore faulty_store_{store_, faults_};
  FaultySink faulty_sink_{network_, faults_};
  std::unique_ptr<InlineJournal> journal_;
  std::unique_ptr<Dispatcher> bridge_;
  std::int64_t boots_ = kFirstBoot;
  std::int64_t driver_boots_ = 100;
  std::int64_t first_ = 0;
  std::unique_ptr<AlarmedDriver> driver_;
};

// Wherever the bridge dies: what its journal calls done is known to every later driver; what it does not, to none.
template <typename Holds>
void KillAtEveryTransition(const std::string& operation, const std::vector<argument_t>& arguments,
                           const Holds& holds) {
  AlarmKills whole(Faults::kNever);
  ASSERT_TRUE(whole.Do(operation, arguments));
  whole.RestartDriver();
  whole.Pass(3 * kSecond);
  ASSERT_TRUE(holds(whole));
  ASSERT_GT(whole.transitions(), 10);
  for (std::int64_t transition = 0; transition < whole.transitions(); ++transition) {
    AlarmKills world(transition);
    ASSERT_TRUE(world.Do(operation, arguments)) << transition;
    world.RestartDriver();
    world.Pass(6 * kSecond);
    EXPECT_EQ(world.bridges(), 2) << transition;
    const bool done = world.Outcome()->state == S::STATE_SUCCEEDED;
    EXPECT_EQ(holds(world), done) << transition << ' ' << StateName(world.Outcome()->state);
    EXPECT_EQ(world.Marks().size(), done ? 1 : 0) << transition;
    if (!done) continue;
    EXPECT_EQ(world.Marks()[0].command, IdOf(world.Outcome()->id)) << transition;
  }
}

TEST(AlarmKills, AnAcknowledgementOutlivesBridgeAndDriver) {
  KillAtEveryTransition("acknowledge_alarm", {{"alarm", "battery_error"}},
                        [](const AlarmKills& world) { return world.alarms().Look("battery_error").acknowledged; });
}

TEST(AlarmKills, AShelfOutlivesBridgeAndDriver) {
  KillAtEveryTransition(
      "shelve_alarm", {{"alarm", "battery_error"}, {"seconds", "3600"}},
      [](const AlarmKills& world) { return world.alarms().shelves().Find("battery_error") != nullptr; });
}

}  // namespace
}  // namespace axlecast
