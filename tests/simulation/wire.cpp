#include "tests/simulation/wire.h"

#include <algorithm>
#include <deque>
#include <span>
#include <utility>

#include "drivers/hal/line_reader.h"
#include "tests/support/can_transmit_queue.h"

namespace axlecast::simulation {

Wire::Wire(Schedule& schedule, Host& host, ProcessThread& thread, Simulator& simulator, std::uint64_t seed)
    : schedule_(schedule), host_(host), thread_(thread), simulator_(simulator), random_(seed, 1) {}

void Wire::Follow() {
  const MonoNs due = simulator_.NextDue();
  if (due == planned_) return;
  planned_ = due;
  const std::int64_t follow = ++follows_;
  if (due == kNever) return;
  schedule_.At(host_.clock.TimeOf(due), [this, follow] {
    if (follow != follows_) return;
    planned_ = kNever;
    // The conversion of its time is exact to 2 ns only.
    const MonoNs now = std::max(host_.clock.Now(), simulator_.NextDue());
    simulator_.OnDue(now, Transmit());
    Follow();
  });
}

std::vector<std::uint8_t> Wire::Damaged(Bytes bytes) {
  std::vector<std::uint8_t> damaged(bytes.begin(), bytes.end());
  if (damaged.empty() || !random_.Happens(faults.noise)) return damaged;
  std::uint8_t& byte = damaged[random_.Index(damaged.size())];
  byte = static_cast<std::uint8_t>(byte ^ 1U << random_.Index(8));
  return damaged;
}

Simulator::Transmit Wire::Transmit() {
  return [this](Bytes bytes) {
    if (faults.unplugged) return;
    if (random_.Happens(faults.loss)) {
      return;
    }
    const std::vector<std::uint8_t> arrives = Damaged(bytes);
    if (ArrivesDamaged() || std::equal(bytes.begin(), bytes.end(), arrives.begin())) Arrive(arrives);
  };
}

void Wire::Arrive(std::vector<std::uint8_t> bytes) {
  MonoNs at = schedule_.now() + random_.Time(0, faults.late);
  if (!faults.scattered) at = std::max(at, last_arrival_);
  last_arrival_ = std::max(at, last_arrival_);
  if (at == schedule_.now()) return OnArrival(bytes);
  schedule_.At(at, [this, bytes = std::move(bytes)] {
    if (!faults.unplugged) OnArrival(bytes);
  });
}

Link::Status Wire::WaitFor(const std::function<bool()>& arrived, bool can_be_lost, MonoNs until) {
  woken_ = false;
  for (;;) {
    if (can_be_lost && faults.unplugged) return Link::Status::kLost;
    if (arrived()) return Link::Status::kOk;
    if (woken_) return Link::Status::kWoken;
    if (host_.clock.Now() >= until) return Link::Status::kTimeout;
    thread_.SleepUntil(until);
  }
}

void Wire::WakeThread() {
  woken_ = true;
  thread_.Wake();
}

namespace {

// A serial line, and the pulse lines beside it.
class SerialWire final : public Wire, public ByteLink, public PulseLines {
 public:
  SerialWire(const BusConfig& bus, Schedule& schedule, Host& host, ProcessThread& thread, Simulator& simulator,
             std::uint64_t seed)
      : Wire(schedule, host, thread, simulator, seed), baud_(bus.link.line.baud) {}

  void PlugInto(DriverPorts& ports) override {
    ports.link = this;
    ports.lines = this;
  }

  [[nodiscard]] Result<> Open() override {
    if (faults.unplugged) return Failure("unplugged: plug it in");
    if (open_) return {};  // the lines open with it
    open_ = true;
    received_.clear();
    simulator_.OnBaud(baud_);
    Follow();
    return {};
  }
  void Close() override { open_ = false; }
  void Release() override { Close(); }
  [[nodiscard]] bool IsOpen() const override { return open_; }
  [[nodiscard]] bool SetBaud(std::int64_t baud) override {
    if (Gone()) return false;
    simulator_.OnBaud(baud);
    return true;
  }
  [[nodiscard]] bool Write(Bytes bytes) override {
    if (Gone()) return false;
    simulator_.OnBytes(bytes, host_.clock.Now(), Transmit());
    Follow();
    return true;
  }
  [[nodiscard]] ReadResult Read(std::span<std::uint8_t> into, MonoNs deadline) override {
    while (!Gone() && received_.empty() && host_.clock.Now() < deadline) thread_.SleepUntil(deadline);
    return ReadNow(into);
  }
  [[nodiscard]] ReadResult ReadNow(std::span<std::uint8_t> into) override {
    if (Gone()) return {Status::kLost, 0};
    const std::size_t count = std::min(into.size(), received_.size());
    std::copy_n(received_.begin(), count, into.begin());
    received_.erase(received_.begin(), received_.begin() + static_cast<std::ptrdiff_t>(count));
    return {count > 0 ? Status::kOk : Status::kTimeout, count};
  }
  [[nodiscard]] Status Wait(MonoNs until) override {
    return WaitFor([this] { return open_ && !received_.empty(); }, open_, until);
  }
  void Wake() override { WakeThread(); }
  [[nodiscard]] LineErrors Errors() const override { return {}; }
  [[nodiscard]] bool Pulse(std::uint8_t line, MonoNs low) override {
    if (Gone()) return false;
    const MonoNs end = host_.clock.Now() + low;
    while (host_.clock.Now() < end) thread_.SleepUntil(end);
    simulator_.OnPulse(line, low, host_.clock.Now(), Transmit());
    Follow();
    return true;
  }

 private:
  [[nodiscard]] bool Gone() const { return !open_ || faults.unplugged; }
  void OnArrival(Bytes bytes) override {
    if (!open_) return;
    received_.insert(received_.end(), bytes.begin(), bytes.end());
    if (random_.Happens(faults.stray)) received_.push_back(static_cast<std::uint8_t>(random_.Next()));
    thread_.Wake();
  }

  const std::int64_t baud_;
  bool open_ = false;
  std::deque<std::uint8_t> received_;
};

// A CAN bus.
class CanWire final : public Wire, public FrameLink {
 public:
  CanWire(const BusConfig& bus, Schedule& schedule, Host& host, ProcessThread& thread, Simulator& simulator,
          std::uint64_t seed)
      : Wire(schedule, host, thread, simulator, seed), bitrate_(bus.link.bitrate) {}

  void PlugInto(DriverPorts& ports) override { ports.frames = this; }

  [[nodiscard]] Result<> Open() override {
    if (faults.unplugged) {
      queue_.Clear();
      return Failure("unplugged: plug it in");
    }
    open_ = true;
    received_.clear();
    queue_.Open();
    simulator_.OnBaud(bitrate_);
    Follow();
    return {};
  }
  void Close() override {
    open_ = false;
    queue_.Close();
  }
  void Release() override { Close(); }
  [[nodiscard]] bool IsOpen() const override { return open_; }
  [[nodiscard]] SendResult Send(const CanFrame& frame) override {
    if (Gone()) return SendResult::kLost;
    const bool first = queue_.empty();
    const SendResult result = queue_.Add(frame);
    if (first) SendWaiting();
    return result;
  }
  [[nodiscard]] Status Receive(Received& received) override {
    if (Gone()) return Status::kLost;
    if (received_.empty()) return Status::kTimeout;
    received = received_.front();
    received_.pop_front();
    return Status::kOk;
  }
  [[nodiscard]] CanController Controller() override { return queue_.Controller(!Gone(), bitrate_); }
  [[nodiscard]] Status Wait(MonoNs until) override {
    return WaitFor([this] { return open_ && !received_.empty(); }, open_, until);
  }
  void Wake() override { WakeThread(); }
  [[nodiscard]] LineErrors Errors() const override { return {}; }

 private:
  [[nodiscard]] bool Gone() const { return !open_ || faults.unplugged; }
  void SendWaiting() {
    queue_.Send(
        simulator_, host_.clock.Now(), [this](const CanFrame& frame, bool own) { ArriveFrame(frame, own); },
        Transmit());
    Follow();
    if (queue_.empty() || again_) return;
    again_ = true;
    schedule_.After(CanTransmitQueue::kSendAgain, [this] {
      again_ = false;
      if (!faults.unplugged) SendWaiting();
    });
  }
  // The controller finds it by the CRC of the frame.
  [[nodiscard]] bool ArrivesDamaged() const override { return false; }
  void OnArrival(Bytes packet) override {
    if (const auto frame = FromPacket(packet)) ArriveFrame(*frame, false);
  }
  void ArriveFrame(const CanFrame& frame, bool own) {
    if (Gone()) return;
    // The kernel's stamp is taken in an interrupt: not before the arrival.
    const MonoNs now = host_.clock.Now();
    received_.push_back({.frame = frame, .at = {now, now}, .own = own});
    thread_.Wake();
  }

  const std::int64_t bitrate_;
  bool open_ = false;
  bool again_ = false;
  CanTransmitQueue queue_;
  std::deque<Received> received_;
};

// An SPI bus: a transfer takes the time of its clocks. Without an encoder, the data line rests high.
class SpiWire final : public Wire, public ClockedLink {
 public:
  SpiWire(const BusConfig& bus, Schedule& schedule, Host& host, ProcessThread& thread, Simulator& simulator,
          std::uint64_t seed)
      : Wire(schedule, host, thread, simulator, seed), ClockedLink("", SpiOf(bus), host.clock) {}

  void PlugInto(DriverPorts& ports) override { ports.link = this; }

  [[nodiscard]] Result<> Open() override {
    open_ = true;
    Follow();
    return {};
  }
  void Close() override {
    open_ = false;
    DropBytes();
  }
  void Release() override { Close(); }
  [[nodiscard]] bool IsOpen() const override { return open_; }
  [[nodiscard]] bool Write(Bytes bytes) override {
    if (!open_ || bytes.size() > kMaxFrame) return false;
    const std::span<std::uint8_t> rx = Fill(bytes.size());
    const MonoNs first_edge = host_.clock.Now();
    simulator_.OnTransfer({.settings = settings_, .tx = bytes}, first_edge, rx);
    if (faults.unplugged || random_.Happens(faults.loss)) std::fill(rx.begin(), rx.end(), std::uint8_t{0xFF});
    const std::vector<std::uint8_t> seen = Damaged(rx);
    std::copy(seen.begin(), seen.end(), rx.begin());
    Follow();
    const MonoNs end = first_edge + settings_.ClockTime(static_cast<std::int64_t>(rx.size()) * 8);
    while (host_.clock.Now() < end) thread_.SleepUntil(end);
    return true;
  }
  [[nodiscard]] ReadResult Read(std::span<std::uint8_t> into, MonoNs deadline) override {
    while (open_ && !HasBytes() && host_.clock.Now() < deadline) thread_.SleepUntil(deadline);
    return ReadNow(into);
  }
  [[nodiscard]] Status Wait(MonoNs until) override {
    return WaitFor([this] { return HasBytes(); }, false, until);
  }
  void Wake() override { WakeThread(); }

 private:
  void OnArrival(Bytes /*bytes*/) override {}  // it sends only while it is clocked

  bool open_ = false;
};

}  // namespace

std::unique_ptr<Wire> MakeWire(const BusConfig& bus, Schedule& schedule, Host& host, ProcessThread& thread,
                               Simulator& simulator, std::uint64_t seed) {
  switch (bus.family->link) {
    case LinkKind::kCan:
      return std::make_unique<CanWire>(bus, schedule, host, thread, simulator, seed);
    case LinkKind::kSpi:
      return std::make_unique<SpiWire>(bus, schedule, host, thread, simulator, seed);
    case LinkKind::kSerial:
    case LinkKind::kModbus:
      break;
  }
  return std::make_unique<SerialWire>(bus, schedule, host, thread, simulator, seed);
}

}  // namespace axlecast::simulation
