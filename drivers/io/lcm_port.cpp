#include "drivers/io/lcm_port.h"

#include <arpa/inet.h>
#include <lcm/lcm.h>
#include <linux/filter.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/random.h>
#include <sys/socket.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <list>
#include <regex>
#include <utility>

#include "drivers/io/descriptor.h"
#include "drivers/io/system_clock.h"
#include "drivers/io/wait_until.h"
#include "drivers/runtime/core/lcm_url.h"

namespace axlecast {
namespace {

constexpr MonoNs kProbeTime = kSecond;
constexpr std::size_t kTokenAt = 22;         // in a self test: behind header, channel and NUL
constexpr int kMostPerHandle = 1'000;        // so that Handle returns under any load
constexpr std::size_t kLongestChannel = 63;  // LCM's

// As a regular expression that matches exactly `text`.
std::string Escaped(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (std::strchr("\\^$.|?*+()[]{}", c) != nullptr) escaped += '\\';
    escaped += c;
  }
  return escaped;
}

// Judged before LCM sees it: put into a group, "a)(b" would be one, and LCM 1.3 leaks on what is none.
bool IsRegularExpression(const std::string& text) {
  try {
    const std::regex compiled(text);
    return true;
  } catch (const std::regex_error&) {
    return false;
  }
}

std::string MulticastRemedy(const std::string& cause) {
  return "multicast on this host is not usable: " + cause +
         "\nMend it (as root), for LCM within this host:\n"
         "  ip link set lo up multicast on\n"
         "  ip route add 224.0.0.0/4 dev lo\n"
         "A firewall must let the group's UDP port pass.";
}

std::string SystemProblem(const char* action) {
  return MulticastRemedy(std::string(action) + ": " + std::strerror(errno));
}

using SelfTestDatagram = std::array<std::uint8_t, 30>;

// What every LCM process sends itself when it first subscribes; others know it and pass over it.
SelfTestDatagram SelfTest() {
  SelfTestDatagram datagram{'L', 'C', '0', '2', 0, 0, 0, 0};  // short header, sequence number 0
  std::memcpy(datagram.data() + 8, "LCM_SELF_TEST", 14);
  if (getrandom(datagram.data() + kTokenAt, 8, 0) != 8) datagram[kTokenAt] = 1;
  return datagram;
}

// Joins the group like any LCM process. An empty string, or the problem.
std::string JoinGroup(int receiver, const sockaddr_in& group) {
  const int on = 1;
  if (setsockopt(receiver, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) != 0) return SystemProblem("SO_REUSEADDR");
  sockaddr_in any = group;
  any.sin_addr.s_addr = htonl(INADDR_ANY);
  if (bind(receiver, reinterpret_cast<const sockaddr*>(&any), sizeof any) != 0) {
    return std::string("the port of LCM cannot be used: ") + std::strerror(errno) +
           "; another program holds it without sharing (ss -ulpn shows which)";
  }
  ip_mreq membership{};
  membership.imr_multiaddr = group.sin_addr;
  if (setsockopt(receiver, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) != 0) {
    return SystemProblem("joining the group");
  }
  return "";
}

// Leaves the group's traffic out, which would fill the socket's buffer before the self test comes. A kernel that cannot
// leaves it in.
void TakeOnly(int receiver, const SelfTestDatagram& datagram) {
  constexpr std::uint32_t kUdpHeader = 8;
  std::uint32_t token = 0;
  std::memcpy(&token, datagram.data() + kTokenAt, sizeof token);
  std::array<sock_filter, 4> steps = {{BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kUdpHeader + kTokenAt),
                                       BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, ntohl(token), 0, 1),
                                       BPF_STMT(BPF_RET | BPF_K, 0xFFFFFFFF), BPF_STMT(BPF_RET | BPF_K, 0)}};
  const sock_fprog program{steps.size(), steps.data()};
  static_cast<void>(setsockopt(receiver, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program));
}

bool Comes(int receiver, const SelfTestDatagram& datagram) {
  const SystemClock clock;
  const MonoNs deadline = clock.Now() + kProbeTime;
  std::array<pollfd, 1> files = {{{receiver, POLLIN, 0}}};
  while (clock.Now() < deadline && PollUntil(files, deadline, clock) > 0) {
    std::array<std::uint8_t, 64> received;
    const ssize_t size = recv(receiver, received.data(), received.size(), MSG_DONTWAIT);
    if (size == static_cast<ssize_t>(datagram.size()) &&
        std::equal(datagram.begin(), datagram.end(), received.begin())) {
      return true;
    }
  }
  return false;
}

std::string ProbeGroup(const LcmUrl& url) {
  sockaddr_in group{};
  group.sin_family = AF_INET;
  group.sin_port = htons(static_cast<std::uint16_t>(url.port));
  inet_pton(AF_INET, url.group.c_str(), &group.sin_addr);

  const Descriptor receiver(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  const Descriptor sender(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (!receiver.valid() || !sender.valid()) return SystemProblem("opening a socket");
  const SelfTestDatagram datagram = SelfTest();
  TakeOnly(receiver.get(), datagram);
  if (std::string problem = JoinGroup(receiver.get(), group); !problem.empty()) return problem;
  const auto ttl = static_cast<unsigned char>(url.ttl);
  if (setsockopt(sender.get(), IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl) != 0) {
    return SystemProblem("IP_MULTICAST_TTL");
  }
  if (sendto(sender.get(), datagram.data(), datagram.size(), 0, reinterpret_cast<const sockaddr*>(&group),
             sizeof group) < 0) {
    return SystemProblem("sending to the group");
  }
  if (Comes(receiver.get(), datagram)) return "";
  return MulticastRemedy("a datagram to " + url.group + " did not come back within 1 s");
}

}  // namespace

std::string MulticastProblem(const std::string& url) {
  const LcmUrl parsed = ParseLcmUrl(url);
  if (!parsed.problem.empty()) return "the LCM URL '" + url + "' " + parsed.problem;
  return parsed.in_process ? "" : ProbeGroup(parsed);
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

  std::string prefix;
  lcm_t* lcm = nullptr;
  std::list<Subscription> subscriptions;  // LCM keeps their addresses
  std::atomic<std::int64_t> unsent{0};
};

LcmPort::LcmPort(const std::string& url, std::string prefix)
    : state_(std::make_unique<State>()), problem_(IsOtherProvider(url) ? "" : MulticastProblem(url)) {
  state_->prefix = std::move(prefix);
  if (!problem_.empty()) return;
  state_->lcm = lcm_create(url.c_str());
  if (state_->lcm == nullptr) problem_ = "LCM refuses the URL '" + url + "': see its own message above";
  // Handling such a port would abort within LCM 1.3. Over UDP nobody must ask: a port that only publishes would begin to
  // receive everything.
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
  std::array<char, kLongestChannel + 1> name;
  const std::size_t size = state_->prefix.size() + channel.size();
  if (state_->lcm == nullptr || size > kLongestChannel) {
    ++state_->unsent;
    return;
  }
  char* end = std::copy(state_->prefix.begin(), state_->prefix.end(), name.data());
  *std::copy(channel.begin(), channel.end(), end) = '\0';
  if (lcm_publish(state_->lcm, name.data(), message.data(), static_cast<unsigned>(message.size())) != 0) {
    ++state_->unsent;
  }
}

bool LcmPort::Subscribe(const std::string& channel, Handler handler, int capacity) {
  if (state_->lcm == nullptr || !IsRegularExpression(channel)) return false;
  state_->subscriptions.push_back({state_->prefix.size(), std::move(handler)});
  State::Subscription& target = state_->subscriptions.back();
  // LCM puts ^ and $ around it; the group keeps an alternative within them.
  const std::string pattern = Escaped(state_->prefix) + "(?:" + channel + ')';
  lcm_subscription_t* subscription = lcm_subscribe(state_->lcm, pattern.c_str(), &State::Dispatch, &target);
  if (subscription == nullptr) {
    state_->subscriptions.pop_back();
    return false;
  }
  return lcm_subscription_set_queue_capacity(subscription, capacity) == 0;
}

bool LcmPort::Handle(int timeout_ms) {
  if (state_->lcm == nullptr) return false;
  errno = 0;
  int handled = lcm_handle_timeout(state_->lcm, timeout_ms);
  for (int i = 1; handled > 0 && i < kMostPerHandle; ++i) handled = lcm_handle_timeout(state_->lcm, 0);
  return handled >= 0 || errno == EINTR;  // a signal is no failure; LCM reports it as one
}

int LcmPort::FileDescriptor() const { return state_->lcm == nullptr ? -1 : lcm_get_fileno(state_->lcm); }

std::int64_t LcmPort::unsent() const { return state_->unsent; }

}  // namespace axlecast
