#include "tests/simulation/simulated_machine.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "core/base/text.h"
#include "core/config/hosts.h"

namespace axlecast::simulation {
namespace {

using K = FaultKind;

constexpr MonoNs kLastReading = 5 * kSecond;  // a device that works has published in this time
constexpr MonoNs kSettled = 10 * kSecond;
constexpr std::size_t kMaxOpen = 20;  // commands under way
constexpr MonoNs kCommandEvery = 2 * kSecond;
constexpr int kInvented = 20;  // names of alarms at a time

// As much of the bound of a late reply as an adapter may take: frames that come unasked share it with their period.
constexpr double kLateShare = 0.4;

// What ends a fault that killed a process. If several did, the first that ends starts it again.
template <typename Process>
std::function<void()> Restart(Process& process) {
  return [&process] {
    if (!process.runs()) process.Start();
  };
}

}  // namespace

MachineConfig ReadSimulatedMachine() {
  ConfigErrors errors(AXLECAST_SOURCE "/tests/simulation/machine.yaml");
  auto machine = LoadConfig(AXLECAST_SOURCE "/tests/simulation/machine.yaml", errors);
  if (!machine) throw std::runtime_error(errors.Text());
  return std::move(*machine);
}

SimulatedMachine::SimulatedMachine(const MachineConfig& machine, std::uint64_t seed)
    : random_(seed, 9),
      promises_(schedule_),
      network_(schedule_, seed),
      left_("left", schedule_, seed, 1'000 * kSecond, random_.Uniform(-49, 49), 0),
      right_("right", schedule_, seed, 90'000 * kSecond, random_.Uniform(-49, 49), 3'000'000),
      left_time_(machine, schedule_, left_, left_time_, network_, promises_),
      right_time_(machine, schedule_, right_, left_time_, network_, promises_),
      bridge_(machine, schedule_, left_, network_, promises_),
      recorder_(schedule_, left_, network_, promises_),
      operators_(
          schedule_, right_, network_, promises_,
          [this](const std::string& device) -> DriverProcess& { return DriverOfDevice(device); }, seed),
      consumer_(
          schedule_, left_, left_, network_, promises_,
          [this](std::int64_t clock_id) -> const Host* {
            if (clock_id == left_.clock_id()) return &left_;
            return clock_id == right_.clock_id() ? &right_ : nullptr;
          },
          [this](const std::string& device) { return DriverOfDevice(device).last_valid(device); }) {
  std::uint64_t number = 0;
  for (const BusConfig& bus : machine.buses) {
    const bool on_right = HostOfBus(machine.hosts, bus.name)->name == "right";
    drivers_.push_back(std::make_unique<DriverProcess>(machine, bus, schedule_, on_right ? right_ : left_, network_,
                                                       promises_, seed * 100 + ++number));
  }
}

SimulatedMachine::~SimulatedMachine() {
  for (auto& driver : drivers_) driver->Kill();
  schedule_.Clear();
}

DriverProcess& SimulatedMachine::DriverOfDevice(const std::string& device) {
  for (const auto& driver : drivers_) {
    for (const DeviceConfig& each : driver->bus().devices) {
      if (each.name == device) return *driver;
    }
  }
  throw std::logic_error("no device " + device);
}

void SimulatedMachine::Run(MonoNs time, const std::vector<Fault>& faults) {
  left_time_.Start();
  right_time_.Start();
  bridge_.Start();
  recorder_.Start();
  for (auto& driver : drivers_) driver->Start();
  for (const Fault& fault : faults) {
    schedule_.At(fault.at, [this, &fault] {
      if (End end = Begin(fault)) schedule_.After(fault.lasts, std::move(end));
    });
  }
  const MonoNs end = kRunIn + time;
  schedule_.At(kRunIn, [this, end] { GiveCommands(end); });
  // What is still under way arrives, and is judged.
  RunUntil(end + kSettled, [] { return false; });
  RunUntil(end + kRecovery, [this] { return Missing().empty(); });
  if (const std::string missing = Missing(); !missing.empty())
    promises_.Breach(missing + " although everything has worked for 30 s");
  RunUntil(end + kOutcomes, [this] { return operators_.open() == 0 && bridge_.store().Open().empty(); });
  if (promises_.count() > 0) return;
  if (operators_.open() > 0) promises_.Breach(std::to_string(operators_.open()) + " commands have no end");
  operators_.Judge(bridge_.store());
  recorder_.Stop();
}

void SimulatedMachine::RunUntil(MonoNs until, const std::function<bool()>& done) {
  while (schedule_.now() < until && promises_.count() == 0 && !done()) {
    schedule_.RunUntil(std::min(schedule_.now() + kSecond, until));
    bridge_.JudgeBounds();
  }
}

void SimulatedMachine::GiveCommands(MonoNs until) {
  if (schedule_.now() >= until) return;
  if (operators_.open() < kMaxOpen) operators_.Command(kNever, false);
  schedule_.After(random_.Delay(kCommandEvery), [this, until] { GiveCommands(until); });
}

std::string SimulatedMachine::Missing() {
  for (const auto& driver : drivers_) {
    for (const DeviceConfig& device : driver->bus().devices) {
      if (schedule_.now() - driver->last_valid(device.name) > kLastReading)
        return device.name + ": no valid reading";
    }
  }
  return bridge_.accepts_changes() ? "" : "the bridge accepts no commands";
}

SimulatedMachine::End SimulatedMachine::Begin(const Fault& fault) {
  promises_.Count("faults");
  promises_.Count(std::string("fault: ") + SpecOf(fault.kind).name);
  switch (fault.kind) {
    case K::kDriverKill:
    case K::kDriverFreeze:
    case K::kBridgeKill:
    case K::kBridgePowerCut:
    case K::kBridgeFreeze:
    case K::kJournalStall:
    case K::kRecorderKill:
    case K::kRecorderPowerCut:
    case K::kTimeKill:
    case K::kTimeFreeze:
      return BeginOnProcess(fault);
    case K::kClientDies:
    case K::kCancel:
      operators_.Command(fault.lasts, fault.kind == K::kCancel);
      return {};
    case K::kAlarmNames:
      operators_.ShelveInventedAlarms(kInvented);
      return {};
    case K::kUnplug:
    case K::kNoise:
    case K::kLostReplies:
    case K::kStrayBytes:
    case K::kLateReplies:
    case K::kOvertakingReplies:
      return BeginOnWire(fault, DriverAt(fault.target));
    case K::kDevicePower:
    case K::kDeviceSilent:
    case K::kDeviceGarbage:
    case K::kSpeed:
      return BeginOnDevice(fault, DriverAt(fault.target));
    case K::kNetworkLoss:
    case K::kDuplication:
    case K::kReordering:
    case K::kPartition:
    case K::kAsymmetry:
      return BeginOnNetwork(fault);
    case K::kUtcStep:
    case K::kSlew:
    case K::kStarvation:
      return BeginOnHost(fault, HostAt(fault.target));
  }
  return {};
}

SimulatedMachine::End SimulatedMachine::BeginOnProcess(const Fault& fault) {
  // All of a power cut's choices, and a process that ends by a signal: the kernel keeps what it has written.
  constexpr CutChoice kAll = {CutChoice::Kind::kEverything, 0};
  const CutChoice cut = {fault.amount < 0.2   ? CutChoice::Kind::kNothing
                         : fault.amount < 0.4 ? CutChoice::Kind::kTorn
                                              : CutChoice::Kind::kRandom,
                         fault.target};
  const MonoNs until = schedule_.now() + fault.lasts;
  switch (fault.kind) {
    case K::kDriverKill:
      DriverAt(fault.target).Kill();
      return Restart(DriverAt(fault.target));
    case K::kDriverFreeze:
      DriverAt(fault.target).thread().Freeze(until);
      return {};
    case K::kBridgeKill:
    case K::kBridgePowerCut:
      bridge_.Kill(fault.kind == K::kBridgeKill ? kAll : cut);
      return Restart(bridge_);
    case K::kBridgeFreeze:
      bridge_.Freeze(until);
      return {};
    case K::kJournalStall:
      bridge_.StallDisk(true);
      return [this] { bridge_.StallDisk(false); };
    case K::kRecorderKill:
    case K::kRecorderPowerCut:
      recorder_.Kill(fault.kind == K::kRecorderKill ? kAll : cut);
      return Restart(recorder_);
    case K::kTimeKill:
      TimeAt(fault.target).Kill();
      return Restart(TimeAt(fault.target));
    default:
      TimeAt(fault.target).Freeze(until);
      return {};
  }
}

SimulatedMachine::End SimulatedMachine::BeginOnWire(const Fault& fault, DriverProcess& driver) {
  Wire& wire = driver.wire();
  WireFaults& faults = wire.faults;
  switch (fault.kind) {
    case K::kUnplug:
      faults.unplugged = true;
      return [&wire] {
        wire.faults.unplugged = false;
        wire.Follow();
      };
    case K::kNoise:
      faults.noise = fault.amount * fault.amount;
      return [&faults] { faults.noise = 0; };
    case K::kLostReplies:
      faults.loss = fault.amount;
      return [&faults] { faults.loss = 0; };
    case K::kStrayBytes:
      faults.stray = fault.amount * fault.amount;
      return [&faults] { faults.stray = 0; };
    default:
      break;
  }
  const bool streams = driver.bus().family->link == LinkKind::kCan;  // CAN adapters keep the order of frames
  faults.scattered = faults.scattered || (fault.kind == K::kOvertakingReplies && !streams);
  faults.late = static_cast<MonoNs>(static_cast<double>(driver.bus().late) * kLateShare * fault.amount);
  return [&faults] {
    faults.late = 0;
    faults.scattered = false;
  };
}

SimulatedMachine::End SimulatedMachine::BeginOnDevice(const Fault& fault, DriverProcess& driver) {
  const std::vector<DeviceConfig>& devices = driver.bus().devices;
  const std::string& device = devices[fault.target / 64 % devices.size()].name;
  const auto works_again = [&driver, &device] { driver.Set(device, "fault", "none", 0); };
  switch (fault.kind) {
    case K::kDevicePower:
      driver.Set(device, "power", "off", fault.lasts + 2 * kSecond);
      return [&driver, &device] { driver.Set(device, "power", "on", 2 * kSecond); };
    case K::kDeviceSilent:
      driver.Set(device, "fault", "off", 0);
      return works_again;
    case K::kDeviceGarbage:
      // A frame of the CAN encoders has no check of its own: random data within reach of the shaft are a position.
      driver.Set(device, "fault", driver.bus().family->link == LinkKind::kCan ? "off" : "garbage", 0);
      return works_again;
    default:
      break;
  }
  // Those that are commanded to zero stay at rest.
  const bool turns = driver.bus().family->has_position && device != "clamp" && device != "joint1" &&
                     device != "hoist" && device != "boom";
  if (turns) driver.Set(device, "speed_rpm", Text("%.3f", 12 * (fault.amount - 0.5)), kSecond);
  return {};
}

SimulatedMachine::End SimulatedMachine::BeginOnNetwork(const Fault& fault) {
  NetworkFaults& network = network_.faults;
  switch (fault.kind) {
    case K::kNetworkLoss:
      network.loss = 0.8 * fault.amount;
      return [&network] { network.loss = 0; };
    case K::kDuplication:
      network.duplication = 0.5 * fault.amount;
      return [&network] { network.duplication = 0; };
    case K::kReordering:
      network.max_delay = static_cast<MonoNs>(fault.amount * 100e6);
      network.stragglers = fault.target % 2 == 0 ? 0.4 * fault.amount : 0;
      return [&network] {
        network.max_delay = 0;
        network.stragglers = 0;
      };
    case K::kPartition:
      network.parted = true;
      return [&network] { network.parted = false; };
    default:
      network.asymmetry = static_cast<MonoNs>(fault.amount * 20e6);
      return [&network] { network.asymmetry = 0; };
  }
}

SimulatedMachine::End SimulatedMachine::BeginOnHost(const Fault& fault, Host& host) {
  switch (fault.kind) {
    case K::kUtcStep:
      host.clock.StepUtc(static_cast<std::int64_t>((fault.amount - 0.5) * 7'200e6));
      return {};
    case K::kSlew:
      host.clock.Slew((fault.amount - 0.5) * 1'800);
      return [&host] { host.clock.Slew(0); };
    default:
      host.starved = static_cast<MonoNs>(fault.amount * 50e6);
      return [&host] { host.starved = 0; };
  }
}

}  // namespace axlecast::simulation
