#include "platform/net/lcm_port.h"

#include <lcm/lcm.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <list>
#include <optional>
#include <regex>
#include <utility>

#include "core/base/result.h"
#include "core/messages/lcm_url.h"
#include "platform/net/group_check.h"
#include "platform/net/group_sender.h"
#include "platform/net/lcm_receiver.h"
#include "platform/os/system_clock.h"

namespace axlecast {
namespace {

void Add(std::string& text, std::int64_t count, const std::string& what) {
  if (count == 0) return;
  if (!text.empty()) text += "; ";
  text += std::to_string(count) + (count == 1 ? " datagram " : " datagrams ") + what;
}

constexpr std::size_t kMaxPerHandle = 1'000;  // so that Handle returns under any load

// As a regular expression that matches exactly `text`.
std::string Escaped(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (std::strchr("\\^$.|?*+()[]{}", c) != nullptr) escaped += '\\';
    escaped += c;
  }
  return escaped;
}

// Checked here, because within a group "a)(b" would be valid, and LCM 1.3 leaks memory for an invalid expression.
bool IsRegularExpression(const std::string& text) {
  try {
    const std::regex compiled(text);
    return true;
  } catch (const std::regex_error&) {
    return false;
  }
}

}  // namespace

ReceptionCounts& ReceptionCounts::operator+=(const ReceptionCounts& other) {
  messages += other.messages;
  dropped += other.dropped;
  outside += other.outside;
  malformed += other.malformed;
  for (const OtherMachine& machine : other.machines) AddMachine(machines, machine);
  if (network.empty()) network = other.network;
  return *this;
}

std::string ReceptionText(const ReceptionCounts& counts, const std::string& remedy) {
  std::string text;
  Add(text, counts.dropped, "lost because this process's receive buffer was full");
  if (counts.dropped > 0 && !remedy.empty()) text += " (" + remedy + ")";
  Add(text, counts.outside, "from other hosts refused, because the URL has ttl=0");
  Add(text, counts.malformed, "refused that are not of LCM");
  if (!counts.machines.empty()) {
    if (!text.empty()) text += "; ";
    text += NamesOf(counts.machines) +
            " uses the same LCM group and port: its messages are refused; give each machine a prefix, a group or a "
            "port of "
            "its own (axlecast doctor)";
  }
  return text.empty() ? "" : "LCM since the start: " + text;
}

std::string NetworkNote(const ReceptionCounts& counts) {
  return counts.network.empty() ? "" : "; LCM: " + counts.network;
}

std::string ReceptionReport::NextLine(const ReceptionCounts& counts, MonoNs now, const std::string& remedy) {
  if (!Changed(counts) || now < next_) return "";
  next_ = now + kInterval;
  const bool returned = !reported_.network.empty() && counts.network.empty();
  reported_ = counts;
  std::string network = counts.network.empty() ? "" : "LCM: " + counts.network;
  if (returned) network = "LCM: the network can be used again";
  const std::string loss = ReceptionText(counts, remedy);
  return network + (network.empty() || loss.empty() ? "" : ". ") + loss;
}

struct LcmPort::State {
  struct Subscription {
    std::size_t prefix_size;
    Handler handler;
  };

  static void Dispatch(const lcm_recv_buf_t* message, const char* channel, void* subscription) {
    const auto& target = *static_cast<const Subscription*>(subscription);
    target.handler(channel + target.prefix_size,
                   Bytes(static_cast<const std::uint8_t*>(message->data), message->data_size));
  }

  State(const std::string& name_prefix, std::string_view machine)
      : prefix(name_prefix), machines(machine), subscribed(name_prefix) {}

  // Returns a handler that calls `handler` with the messages of this machine only.
  Handler OfThisMachine(Handler handler) {
    return [this, handler = std::move(handler)](const std::string& channel, Bytes message) {
      if (machines.Takes(message)) return handler(channel, message);
      machines.Refuse(message, clock.Now());
    };
  }

  bool Send(const std::string& channel, Bytes message);
  bool SubscribeByLcm(const std::string& channel, Handler handler, int capacity);
  bool HandleByLcm(int timeout_ms) const;
  bool HandleGroup(int timeout_ms);

  const SystemClock clock;
  const std::string prefix;
  MachineFilter machines;
  std::atomic<std::int64_t> unsent{0};
  lcm_t* lcm = nullptr;
  std::list<Subscription> subscriptions;  // of liblcm, which stores their addresses
  std::optional<LcmUrl> group;            // of udpm://
  std::optional<GroupSender> sender;      // to it
  ChannelSubscriptions subscribed;        // to it
  std::optional<LcmReceiver> receiver;    // of it, from the first subscription on
};

LcmPort::LcmPort(const std::string& url, const std::string& prefix, std::string_view machine)
    : state_(std::make_unique<State>(prefix, machine)),
      problem_(IsOtherProvider(url) ? "" : ErrorText(CheckMulticast(url))) {
  if (!problem_.empty()) return;
  if (auto parsed = ParseLcmUrl(url); parsed && !parsed->in_process) {
    state_->group = std::move(*parsed);
    state_->sender.emplace(*state_->group);
    return;
  }
  state_->lcm = lcm_create(url.c_str());
  if (state_->lcm == nullptr) problem_ = "LCM refuses the URL '" + url + "': see its own message above";
  // LCM 1.3 would abort when such a port is handled.
  if (state_->lcm != nullptr && IsOtherProvider(url) && FileDescriptor() < 0) {
    lcm_destroy(std::exchange(state_->lcm, nullptr));
    problem_ = url + ": no server answers there; liblcm's own is started by\n" +
               "  java -cp /usr/share/java/lcm.jar lcm.lcm.TCPService PORT";
  }
}

LcmPort::~LcmPort() {
  if (state_->lcm != nullptr) lcm_destroy(state_->lcm);
}

void LcmPort::Publish(const std::string& channel, Bytes message) {
  if (!state_->Send(channel, message)) ++state_->unsent;
}

bool LcmPort::State::Send(const std::string& channel, Bytes message) {
  std::array<char, kLongestChannel + 1> name;
  const std::size_t size = prefix.size() + channel.size();
  if (size > kLongestChannel) return false;
  char* end = std::copy(prefix.begin(), prefix.end(), name.data());
  *std::copy(channel.begin(), channel.end(), end) = '\0';
  if (sender) return sender->Send({name.data(), size}, message);
  return lcm != nullptr &&
         lcm_publish(lcm, name.data(), message.data(), static_cast<unsigned>(message.size())) == 0;
}

bool LcmPort::Subscribe(const std::string& channel, Handler handler, int capacity) {
  if (!problem_.empty() || !IsRegularExpression(channel)) return false;
  handler = state_->OfThisMachine(std::move(handler));
  if (!state_->group) return state_->SubscribeByLcm(channel, std::move(handler), capacity);
  if (!state_->receiver) state_->receiver.emplace(*state_->group);
  problem_ = state_->receiver->problem();
  return problem_.empty() && state_->subscribed.Add(channel, std::move(handler));
}

bool LcmPort::State::SubscribeByLcm(const std::string& channel, Handler handler, int capacity) {
  subscriptions.push_back({prefix.size(), std::move(handler)});
  // LCM adds ^ and $; the group keeps an alternative between them.
  const std::string pattern = Escaped(prefix) + "(?:" + channel + ')';
  lcm_subscription_t* subscription = lcm_subscribe(lcm, pattern.c_str(), &State::Dispatch, &subscriptions.back());
  if (subscription == nullptr) {
    subscriptions.pop_back();
    return false;
  }
  return lcm_subscription_set_queue_capacity(subscription, capacity) == 0;
}

bool LcmPort::Handle(int timeout_ms) {
  if (state_->group) return state_->HandleGroup(timeout_ms);
  return state_->lcm != nullptr && state_->HandleByLcm(timeout_ms);
}

bool LcmPort::State::HandleByLcm(int timeout_ms) const {
  errno = 0;
  int handled = lcm_handle_timeout(lcm, timeout_ms);
  for (std::size_t i = 1; handled > 0 && i < kMaxPerHandle; ++i) handled = lcm_handle_timeout(lcm, 0);
  return handled >= 0 || errno == EINTR;  // a signal is no failure; LCM reports it as one
}

// As in liblcm, messages of other channels do not end the wait.
bool LcmPort::State::HandleGroup(int timeout_ms) {
  const MonoNs deadline = clock.Now() + timeout_ms * kMillisecond;
  std::size_t called = 0;
  std::size_t read = 0;
  for (MonoNs left = timeout_ms * kMillisecond;; left = deadline - clock.Now()) {
    pollfd readable = {receiver ? receiver->FileDescriptor() : -1, POLLIN, 0};
    const auto left_ms = static_cast<int>((std::max<MonoNs>(left, 0) + kMillisecond - 1) / kMillisecond);
    if (left_ms > 0 && called == 0 && poll(&readable, 1, left_ms) < 0)
      return errno == EINTR;  // a signal is no failure
    if ((readable.revents & POLLNVAL) != 0) return false;
    const std::size_t batch = receiver ? receiver->Read([this, &called](std::string_view channel, Bytes message) {
      called += subscribed.Dispatch(channel, message);
    })
                                       : 0;
    read += batch;
    const bool over = called > 0 || left <= 0;
    if (over && (batch < LcmReceiver::kPerRead || read >= kMaxPerHandle)) return true;
  }
}

int LcmPort::FileDescriptor() const {
  if (state_->group) return state_->receiver ? state_->receiver->FileDescriptor() : -1;
  return state_->lcm == nullptr ? -1 : lcm_get_fileno(state_->lcm);
}

ReceptionCounts LcmPort::received() const {
  ReceptionCounts counts = state_->receiver ? state_->receiver->counts() : ReceptionCounts();
  counts.machines = state_->machines.Others(state_->clock.Now());
  if (counts.network.empty() && state_->sender) counts.network = ErrorText(state_->sender->Check());
  return counts;
}

std::string LcmPort::warning() const { return state_->receiver ? state_->receiver->warning() : ""; }

std::int64_t LcmPort::unsent() const { return state_->unsent; }

}  // namespace axlecast
