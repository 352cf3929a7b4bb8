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

// As much of the bound of a late reply as an adapter may take: frames that come unasked share it with their period.
constexpr double kLateShare = 0.4;

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
    schedule_.At(fault.at, [this, &fault] { Begin(fault); });
    schedule_.At(fault.at + fault.lasts, [this, &fault] { End(fault); });
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

void SimulatedMachine::Begin(const Fault& fault) {
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
    case K::kClientDies:
    case K::kCancel:
      return BeginOnProcess(fault);
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
    default:
      return BeginOnNetwork(fault);
  }
}

void SimulatedMachine::BeginOnProcess(const Fault& fault) {
  // All of a power cut's choices, and a process that ends by a signal: the kernel keeps what it has written.
  constexpr CutChoice kAll = {CutChoice::Kind::kEverything, 0};
  const CutChoice cut = {fault.amount < 0.2   ? CutChoice::Kind::kNothing
                         : fault.amount < 0.4 ? CutChoice::Kind::kTorn
                                              : CutChoice::Kind::kRandom,
                         fault.target};
  const MonoNs until = schedule_.now() + fault.lasts;
  switch (fault.kind) {
    case K::kDriverKill:
      return DriverAt(fault.target).Kill();
    case K::kDriverFreeze:
      return DriverAt(fault.target).thread().Freeze(until);
    case K::kBridgeKill:
      return bridge_.Kill(kAll);
    case K::kBridgePowerCut:
      return bridge_.Kill(cut);
    case K::kBridgeFreeze:
      return bridge_.Freeze(until);
    case K::kJournalStall:
      return bridge_.StallDisk(true);
    case K::kRecorderKill:
      return recorder_.Kill(kAll);
    case K::kRecorderPowerCut:
      return recorder_.Kill(cut);
    case K::kTimeKill:
      return TimeAt(fault.target).Kill();
    case K::kTimeFreeze:
      return TimeAt(fault.target).Freeze(until);
    default:
      return operators_.Command(fault.lasts, fault.kind == K::kCancel);
  }
}

void SimulatedMachine::BeginOnWire(const Fault& fault, DriverProcess& driver) {
  WireFaults& wire = driver.wire().faults;
  const bool streams = driver.bus().family->link == LinkKind::kCan;
  const auto late = static_cast<MonoNs>(static_cast<double>(driver.bus().late) * kLateShare * fault.amount);
  switch (fault.kind) {
    case K::kUnplug:
      wire.unplugged = true;
      return;
    case K::kNoise:
      wire.noise = fault.amount * fault.amount;
      return;
    case K::kLostReplies:
      wire.loss = fault.amount;
      return;
    case K::kStrayBytes:
      wire.stray = fault.amount * fault.amount;
      return;
    case K::kOvertakingReplies:
      wire.scattered = !streams;  // CAN adapters keep the order of frames
      wire.late = late;
      return;
    default:
      wire.late = late;
      return;
  }
}

void SimulatedMachine::BeginOnDevice(const Fault& fault, DriverProcess& driver) {
  const std::vector<DeviceConfig>& devices = driver.bus().devices;
  const std::string& device = devices[fault.target / 64 % devices.size()].name;
  switch (fault.kind) {
    case K::kDevicePower:
      return driver.Set(device, "power", "off", fault.lasts + 2 * kSecond);
    case K::kDeviceSilent:
      return driver.Set(device, "fault", "off", 0);
    case K::kDeviceGarbage:
      // A frame of the CAN encoders has no check of its own: random data within reach of the shaft are a position.
      return driver.Set(device, "fault", driver.bus().family->link == LinkKind::kCan ? "off" : "garbage", 0);
    default:
      break;
  }
  // Those that are commanded to zero stay at rest.
  const bool turns = driver.bus().family->has_position && device != "clamp" && device != "joint1" &&
                     device != "hoist" && device != "boom";
  if (turns) driver.Set(device, "speed_rpm", Text("%.3f", 12 * (fault.amount - 0.5)), kSecond);
}

void SimulatedMachine::BeginOnNetwork(const Fault& fault) {
  NetworkFaults& network = network_.faults;
  Host& host = HostAt(fault.target);
  switch (fault.kind) {
    case K::kNetworkLoss:
      network.loss = 0.8 * fault.amount;
      return;
    case K::kDuplication:
      network.duplication = 0.5 * fault.amount;
      return;
    case K::kReordering:
      network.max_delay = static_cast<MonoNs>(fault.amount * 100e6);
      network.stragglers = fault.target % 2 == 0 ? 0.4 * fault.amount : 0;
      return;
    case K::kPartition:
      network.parted = true;
      return;
    case K::kAsymmetry:
      network.asymmetry = static_cast<MonoNs>(fault.amount * 20e6);
      return;
    case K::kUtcStep:
      host.clock.StepUtc(static_cast<std::int64_t>((fault.amount - 0.5) * 7'200e6));
      return;
    case K::kSlew:
      host.clock.Slew((fault.amount - 0.5) * 1'800);
      return;
    default:
      host.starved = static_cast<MonoNs>(fault.amount * 50e6);
      return;
  }
}

void SimulatedMachine::End(const Fault& fault) {
  DriverProcess& driver = DriverAt(fault.target);
  WireFaults& wire = driver.wire().faults;
  switch (fault.kind) {
    case K::kDriverKill:
      if (!driver.runs()) driver.Start();
      return;
    case K::kBridgeKill:
    case K::kBridgePowerCut:
      if (!bridge_.runs()) bridge_.Start();
      return;
    case K::kJournalStall:
      return bridge_.StallDisk(false);
    case K::kRecorderKill:
    case K::kRecorderPowerCut:
      if (!recorder_.runs()) recorder_.Start();
      return;
    case K::kTimeKill:
      if (!TimeAt(fault.target).runs()) TimeAt(fault.target).Start();
      return;
    case K::kNetworkLoss:
      network_.faults.loss = 0;
      return;
    case K::kDuplication:
      network_.faults.duplication = 0;
      return;
    case K::kReordering:
      network_.faults.max_delay = 0;
      network_.faults.stragglers = 0;
      return;
    case K::kPartition:
      network_.faults.parted = false;
      return;
    case K::kAsymmetry:
      network_.faults.asymmetry = 0;
      return;
    case K::kUnplug:
      wire.unplugged = false;
      return driver.wire().Follow();
    case K::kNoise:
      wire.noise = 0;
      return;
    case K::kLostReplies:
      wire.loss = 0;
      return;
    case K::kStrayBytes:
      wire.stray = 0;
      return;
    case K::kLateReplies:
    case K::kOvertakingReplies:
      wire.late = 0;
      wire.scattered = false;
      return;
    case K::kDevicePower:
    case K::kDeviceSilent:
    case K::kDeviceGarbage: {
      const std::vector<DeviceConfig>& devices = driver.bus().devices;
      const std::string& device = devices[fault.target / 64 % devices.size()].name;
      return fault.kind == K::kDevicePower ? driver.Set(device, "power", "on", 2 * kSecond)
                                           : driver.Set(device, "fault", "none", 0);
    }
    case K::kSlew:
      HostAt(fault.target).clock.Slew(0);
      return;
    case K::kStarvation:
      HostAt(fault.target).starved = 0;
      return;
    default:
      return;
  }
}

}  // namespace axlecast::simulation
