#include "drivers/runtime/bus/line_medium.h"

#include <algorithm>
#include <type_traits>
#include <utility>
#include <variant>

namespace axlecast {

using Status = ByteLink::Status;

namespace {

// So long after a secret exchange, whatever may be a late reply to it is masked too: longer than any device or adapter
// holds one back.
constexpr MonoNs kMaskLate = 2 * kSecond;
// Address and function, where frames have them: a reply that begins as its request does is no other's.
constexpr std::size_t kHead = 2;

bool BeginsAsRequest(const Event& event) {
  return event.kind == Event::Kind::kReply && event.request.size() >= kHead && event.bytes.size() >= kHead &&
         std::equal(event.request.begin(), event.request.begin() + kHead, event.bytes.begin());
}

}  // namespace

const Event* LineMedium::FindStray() {
  if (!excess_.empty()) return Excess();
  const ByteLink::ReadResult read = link_.ReadNow({buffer_.data(), kMaxFrame});
  if (read.status == Status::kOk && read.count > 0) return Arrived(Event::Kind::kStray, read.count);
  if (read.status == Status::kLost) return Lost();
  return nullptr;
}

const Event* LineMedium::Run(const Step& step, MonoNs by) {
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

const Event* LineMedium::Run(const Exchange& exchange) {
  event_.request = exchange.request;
  event_.sent.first = clock_.Now();
  event_.secret = exchange.secret;
  if (!Ask(exchange)) return Lost();
  event_.sent.last = clock_.Now();
  const Event* event = Collect(exchange, event_.sent.last + exchange.timeout);
  if (exchange.secret) {
    masked_until_ = clock_.Now() + kMaskLate;
  } else if (event_.sent.first < masked_until_) {
    event_.secret = !BeginsAsRequest(event_);
  }
  return event;
}

bool LineMedium::Ask(const Exchange& exchange) {
  return exchange.pulse ? Give(*exchange.pulse) : link_.Write(exchange.request);
}

const Event* LineMedium::Run(const Pulse& pulse) {
  Interval sent{clock_.Now(), 0};
  if (!Give(pulse)) return Lost();
  sent.last = clock_.Now();
  event_ = {.kind = Event::Kind::kPulsed, .sent = sent, .received = sent, .request = {}, .bytes = {}};
  return &event_;
}

const Event* LineMedium::Run(const Retune& retune) {
  if (!link_.SetBaud(retune.baud)) return Lost();
  const MonoNs now = clock_.Now();
  event_ = {.kind = Event::Kind::kRetuned, .sent = {}, .received = {now, now}, .request = {}, .bytes = {}};
  return &event_;
}

const Event* LineMedium::Run(const Silence& silence) {
  if (!excess_.empty()) return Excess();
  const MonoNs since = clock_.Now();
  const ByteLink::ReadResult read = link_.Read({buffer_.data(), kMaxFrame}, since + silence.quiet);
  if (read.status == Status::kOk) return Arrived(Event::Kind::kStray, read.count);
  if (read.status == Status::kLost) return Lost();
  return Silent(since);
}

const Event* LineMedium::Run(const Listen& listen, MonoNs by) {
  if (!excess_.empty()) return Excess();
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

const Event* LineMedium::Sleep(MonoNs by) {
  if (!excess_.empty()) return Excess();
  const Status status = link_.Wait(by);
  if (status == Status::kLost) return Lost();
  return status == Status::kOk ? FindStray() : nullptr;
}

const Event* LineMedium::Collect(const Exchange& exchange, MonoNs deadline) {
  const std::size_t skip = echo_ ? exchange.request.size() : 0;
  std::size_t count = 0;
  while (count < skip + kMaxFrame) {
    const std::span<std::uint8_t> room(buffer_.data() + count, skip + kMaxFrame - count);
    const ByteLink::ReadResult read = link_.Read(room, deadline);
    if (read.status == Status::kLost) return Lost();
    if (read.status != Status::kOk) return TimedOut(skip, count);
    event_.received.last = clock_.Now();
    if (count <= skip) event_.received.first = event_.received.last;
    count += read.count;
    if (count <= skip) continue;
    if (exchange.reply_length == nullptr) continue;
    const std::size_t length = exchange.reply_length({buffer_.data() + skip, count - skip});
    if (length != 0 && count - skip >= length) return Complete(skip, length, count);
  }
  return TimedOut(skip, count);
}

const Event* LineMedium::Complete(std::size_t skip, std::size_t length, std::size_t count) {
  if (!EchoMatches(skip)) return TimedOut(skip, count);
  event_.kind = Event::Kind::kReply;
  event_.bytes = {buffer_.data() + skip, length};
  excess_ = {buffer_.data() + skip + length, count - skip - length};
  return &event_;
}

const Event* LineMedium::TimedOut(std::size_t skip, std::size_t count) {
  const bool echoed = count >= skip && EchoMatches(skip);
  event_.kind = Event::Kind::kTimeout;
  event_.bytes = echoed ? Bytes(buffer_.data() + skip, count - skip) : Bytes(buffer_.data(), count);
  if (event_.bytes.empty()) {
    event_.received.last = clock_.Now();
    event_.received.first = event_.received.last;
  }
  return &event_;
}

bool LineMedium::EchoMatches(std::size_t skip) const {
  return std::equal(event_.request.begin(), event_.request.begin() + static_cast<std::ptrdiff_t>(skip),
                    buffer_.begin());
}

const Event* LineMedium::Arrived(Event::Kind kind, std::size_t count) {
  const MonoNs now = clock_.Now();
  event_ = {.kind = kind,
            .sent = {},
            .received = {now, now},
            .request = {},
            .bytes = {buffer_.data(), count},
            .secret = now < masked_until_};
  return &event_;
}

const Event* LineMedium::Silent(MonoNs since) {
  event_ = {
      .kind = Event::Kind::kSilent, .sent = {}, .received = {since, clock_.Now()}, .request = {}, .bytes = {}};
  return &event_;
}

const Event* LineMedium::Excess() {
  event_.kind = Event::Kind::kStray;
  event_.secret = event_.secret || clock_.Now() < masked_until_;
  event_.sent = {};
  event_.request = {};
  event_.bytes = std::exchange(excess_, {});
  return &event_;
}

const Event* LineMedium::Lost() {
  excess_ = {};
  const MonoNs now = clock_.Now();
  event_ = {.kind = Event::Kind::kLinkDown, .sent = {}, .received = {now, now}, .request = {}, .bytes = {}};
  return &event_;
}

}  // namespace axlecast
