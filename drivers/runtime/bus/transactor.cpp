#include "drivers/runtime/bus/transactor.h"

#include <algorithm>
#include <type_traits>
#include <utility>
#include <variant>

namespace axlecast {

using Status = Link::Status;

const Event* CanTransactor::Run(const Step& step, MonoNs by) {
  if (const auto* send = std::get_if<Send>(&step.action)) return Transmit(send->frame);
  if (std::holds_alternative<Idle>(step.action)) return Receive(by);
  const auto* listen = std::get_if<Listen>(&step.action);
  if (listen == nullptr) return Ended(Event::Kind::kLinkDown, {clock_.Now(), clock_.Now()});
  const MonoNs since = clock_.Now();
  const Event* event = Receive(std::min(listen->until, by));
  if (event != nullptr) return event;
  const MonoNs now = clock_.Now();
  return now >= listen->until ? Ended(Event::Kind::kSilent, {since, now}) : nullptr;
}

const Event* CanTransactor::Transmit(const CanFrame& frame) {
  Interval at{clock_.Now(), 0};
  const FrameLink::SendResult result = link_.Send(frame);
  at.last = clock_.Now();
  if (result == FrameLink::SendResult::kLost) return Ended(Event::Kind::kLinkDown, at);
  const bool queued = result == FrameLink::SendResult::kQueued;
  static_cast<void>(Ended(queued ? Event::Kind::kSent : Event::Kind::kNotSent, at));
  event_.id = frame.id;
  event_.bytes = frame.data;
  return &event_;
}

const Event* CanTransactor::Receive(MonoNs by) {
  Status status = link_.Receive(received_);
  if (status == Status::kTimeout) {
    status = link_.Wait(by);
    if (status == Status::kOk) status = link_.Receive(received_);
  }
  if (status == Status::kLost) return Ended(Event::Kind::kLinkDown, {clock_.Now(), clock_.Now()});
  return status == Status::kOk ? Arrived() : nullptr;
}

const Event* CanTransactor::Arrived() {
  static_cast<void>(Ended(received_.own ? Event::Kind::kConfirmed : Event::Kind::kFrame, received_.at));
  event_.id = received_.frame.id;
  event_.bytes = received_.frame.data;
  return &event_;
}

const Event* CanTransactor::Ended(Event::Kind kind, Interval at) {
  event_ = {.kind = kind, .sent = {}, .received = at, .request = {}, .bytes = {}};
  return &event_;
}

namespace {

constexpr MonoNs kLook = 50 * kMillisecond;  // how soon a stop is noticed if nothing comes

constexpr std::size_t kTheProbe = 0;  // the guard's only device

// Before a request is sent, no bytes may be unread, and no late reply may be possible that looks like its reply.
const Event* Carry(const Step& step, Transactor& transactor, StaleReplyGuard& guard, MonoNs now) {
  const auto* exchange = std::get_if<Exchange>(&step.action);
  if (exchange == nullptr) return transactor.Run(step, now + kLook);
  if (const Event* stray = transactor.FindStray()) return stray;
  const MonoNs free_at = guard.FreeAt(*exchange, now);
  if (free_at > now) return transactor.Run(Step{.action = Idle{free_at}}, std::min(free_at, now + kLook));
  const Event* event = transactor.Run(step, now + kLook);
  guard.Ended(*exchange, kTheProbe, *event);
  return event;
}

}  // namespace

bool RunProbe(Probe& probe, Transactor& transactor, const Clock& clock, StaleReplyGuard& guard,
              const std::function<bool()>& stop) {
  while (!stop()) {
    const MonoNs now = clock.Now();
    const std::optional<Step> step = probe.Next(now);
    if (!step) return true;
    const Event* event = Carry(*step, transactor, guard, now);
    if (event == nullptr) continue;
    if (event->kind == Event::Kind::kUnexpectedBytes && !event->early)
      guard.CameUnexpected(event->bytes, event->received.last);
    probe.On(*event);
    if (event->kind == Event::Kind::kLinkDown) return false;
  }
  return true;
}

using Status = ByteLink::Status;

namespace {

// How long after a secret exchange a possible late reply to it is masked too: longer than any device or adapter delays a
// reply.
constexpr MonoNs kMaskLate = 2 * kSecond;
// Address and function, if frames have them.
constexpr std::size_t kHead = 2;

bool BeginsAs(Bytes request, Bytes bytes) {
  return request.size() >= kHead && bytes.size() >= kHead &&
         std::equal(request.begin(), request.begin() + kHead, bytes.begin());
}

}  // namespace

const Event* SerialTransactor::FindStray() {
  if (HasExcess()) return Excess();
  if (clock_.Now() - std::exchange(empty_at_, kLongAgo) <= kJustWaited) return nullptr;
  const ByteLink::ReadResult read = link_.ReadNow({buffer_.data(), kMaxFrame});
  if (read.status == Status::kOk && read.count > 0) return Arrived(Event::Kind::kUnexpectedBytes, read.count);
  if (read.status == Status::kLost) return Lost();
  return nullptr;
}

const Event* SerialTransactor::Run(const Step& step, MonoNs by) {
  return std::visit(
      [this, by](const auto& action) -> const Event* {
        using Action = std::decay_t<decltype(action)>;
        if constexpr (std::is_same_v<Action, Idle>)
          return Sleep(by);
        else if constexpr (std::is_same_v<Action, Listen>)
          return Run(action, by);
        else if constexpr (std::is_same_v<Action, Send>)
          return Lost();
        else
          return Run(action);
      },
      step.action);
}

const Event* SerialTransactor::Run(const Exchange& exchange) {
  event_.request = exchange.request;
  event_.sent.first = clock_.Now();
  event_.secret = exchange.secret;
  event_.early = false;
  if (!Transmit(exchange)) return Lost();
  event_.sent.last = clock_.Now();
  if (transmitted_) transmitted_();
  const Event* event = Collect(exchange, event_.sent.last + exchange.timeout);
  if (exchange.secret) {
    masked_until_ = clock_.Now() + kMaskLate;
    const Bytes request = exchange.request;
    masked_head_ = Frame(request.first(std::min(request.size(), kHead)));
  } else if (event_.sent.first < masked_until_) {
    // A reply that begins like its request is its own, unless the secret request also began like this.
    const bool own = event_.kind == Event::Kind::kReply && BeginsAs(event_.request, event_.bytes);
    event_.secret = !own || BeginsAs(masked_head_, event_.bytes);
  }
  return event;
}

bool SerialTransactor::Transmit(const Exchange& exchange) {
  return exchange.pulse ? Transmit(*exchange.pulse) : link_.Write(exchange.request);
}

const Event* SerialTransactor::Run(const Pulse& pulse) {
  Interval sent{clock_.Now(), 0};
  if (!Transmit(pulse)) return Lost();
  sent.last = clock_.Now();
  event_ = {.kind = Event::Kind::kPulsed, .sent = sent, .received = sent, .request = {}, .bytes = {}};
  return &event_;
}

const Event* SerialTransactor::Run(const SetBaudRate& change) {
  if (!link_.SetBaud(change.baud)) return Lost();
  const MonoNs now = clock_.Now();
  if (opened_.baud > 0) line_.baud = change.baud;
  event_ = {.kind = Event::Kind::kBaudRateSet, .sent = {}, .received = {now, now}, .request = {}, .bytes = {}};
  return &event_;
}

const Event* SerialTransactor::Run(const WaitForIdleLine& idle) {
  if (HasExcess()) return Excess();
  const MonoNs since = clock_.Now();
  const ByteLink::ReadResult read = link_.Read({buffer_.data(), kMaxFrame}, since + idle.quiet);
  if (read.status == Status::kOk) return Arrived(Event::Kind::kUnexpectedBytes, read.count);
  if (read.status == Status::kLost) return Lost();
  return Silent(since);
}

const Event* SerialTransactor::Run(const Listen& listen, MonoNs by) {
  if (HasExcess()) return Excess();
  const MonoNs since = clock_.Now();
  const Status status = link_.Wait(std::min(listen.until, by));
  if (status == Status::kLost) return Lost();
  if (status == Status::kOk) {
    const ByteLink::ReadResult read = link_.ReadNow({buffer_.data(), kMaxFrame});
    if (read.status == Status::kLost) return Lost();
    return read.count > 0 ? Arrived(Event::Kind::kUnsolicited, read.count) : nullptr;
  }
  return status == Status::kTimeout && listen.until <= by ? Silent(since) : nullptr;
}

const Event* SerialTransactor::Sleep(MonoNs by) {
  if (HasExcess()) return Excess();
  const Status status = link_.Wait(by);
  if (status == Status::kLost) return Lost();
  if (status == Status::kTimeout) empty_at_ = clock_.Now();
  return status == Status::kOk ? FindStray() : nullptr;
}

const Event* SerialTransactor::Collect(const Exchange& exchange, MonoNs deadline) {
  const std::size_t echo = EchoSize();
  std::size_t begin = echo;  // of the reply: behind the echo, and behind what came too early
  std::size_t count = 0;
  read_count_ = 0;
  while (count < echo + kMaxFrame) {
    const std::span<std::uint8_t> room(buffer_.data() + count, echo + kMaxFrame - count);
    const ByteLink::ReadResult read = link_.Read(room, deadline);
    if (read.status == Status::kLost) return Lost();
    if (read.status != Status::kOk) return TimedOut(begin, count);
    count += read.count;
    NoteRead(count);
    while (count > begin && exchange.reply_length != nullptr) {
      const std::size_t length = exchange.reply_length({buffer_.data() + begin, count - begin});
      if (length == 0 || count - begin < length) break;
      if (!TooEarly(exchange, begin, length)) return Complete(begin, length, count);
      begin += length;
      early_ = Frame(Bytes(buffer_.data() + echo, std::min(begin - echo, kMaxFrame)));
      early_waits_ = true;
    }
  }
  return TimedOut(begin, count);
}

void SerialTransactor::NoteRead(std::size_t end) {
  event_.received.last = clock_.Now();
  // After many small reads, the newest ones share the latest time, which is not before the true one.
  if (read_count_ < reads_.size()) ++read_count_;
  reads_[read_count_ - 1] = {end, event_.received.last};
}

MonoNs SerialTransactor::ArrivalOf(std::size_t index) const {
  for (std::size_t i = 0; i < read_count_; ++i) {
    if (reads_[i].end > index) return reads_[i].at;
  }
  return event_.received.last;
}

bool SerialTransactor::TooEarly(const Exchange& exchange, std::size_t begin, std::size_t length) {
  const Bytes reply(buffer_.data() + begin, length);
  const std::size_t own = exchange.reply_begin == nullptr ? 0 : exchange.reply_begin(reply);
  event_.received.first = ArrivalOf(begin + own);
  const auto too_early = [&](MonoNs at, std::size_t characters) {
    const auto carried = static_cast<MonoNs>(event_.request.size() + characters);
    return at - event_.sent.first < carried * line_.ShortestCharacter();
  };
  // HasWire is called last, because it accesses the port.
  return EchoMatches() && (too_early(event_.received.first, 1) || too_early(event_.received.last, length - own)) &&
         link_.HasWire();
}

const Event* SerialTransactor::Complete(std::size_t begin, std::size_t length, std::size_t count) {
  if (!EchoMatches()) return TimedOut(begin, count);
  event_.kind = Event::Kind::kReply;
  event_.bytes = {buffer_.data() + begin, length};
  excess_ = {buffer_.data() + begin + length, count - begin - length};
  return &event_;
}

const Event* SerialTransactor::TimedOut(std::size_t begin, std::size_t count) {
  const bool echoed = count >= begin && EchoMatches();
  event_.kind = Event::Kind::kTimeout;
  event_.bytes = echoed ? Bytes(buffer_.data() + begin, count - begin) : Bytes(buffer_.data(), count);
  event_.received.first = ArrivalOf(echoed ? begin : 0);
  if (event_.bytes.empty()) {
    event_.received.last = clock_.Now();
    event_.received.first = event_.received.last;
  }
  return &event_;
}

bool SerialTransactor::EchoMatches() const {
  return std::equal(event_.request.begin(), event_.request.begin() + static_cast<std::ptrdiff_t>(EchoSize()),
                    buffer_.begin());
}

const Event* SerialTransactor::Arrived(Event::Kind kind, std::size_t count) {
  const MonoNs now = clock_.Now();
  event_ = {.kind = kind,
            .sent = {},
            .received = {now, now},
            .request = {},
            .bytes = {buffer_.data(), count},
            .secret = now < masked_until_};
  return &event_;
}

const Event* SerialTransactor::Silent(MonoNs since) {
  event_ = {
      .kind = Event::Kind::kSilent, .sent = {}, .received = {since, clock_.Now()}, .request = {}, .bytes = {}};
  return &event_;
}

const Event* SerialTransactor::Excess() {
  event_.kind = Event::Kind::kUnexpectedBytes;
  event_.early = early_waits_;
  event_.secret = event_.secret || clock_.Now() < masked_until_;
  event_.sent = {};
  event_.request = {};
  event_.bytes = std::exchange(early_waits_, false) ? Bytes(early_) : std::exchange(excess_, {});
  return &event_;
}

const Event* SerialTransactor::Lost() {
  excess_ = {};
  early_waits_ = false;
  line_ = opened_;
  const MonoNs now = clock_.Now();
  event_ = {.kind = Event::Kind::kLinkDown, .sent = {}, .received = {now, now}, .request = {}, .bytes = {}};
  return &event_;
}

}  // namespace axlecast
