#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "platform/net/datagram_test_support.h"
#include "platform/os/descriptor.h"
#include "tools/log/log_event.h"

namespace axlecast {

// A test of a reception or recording that takes longer has hung, and ends the program: s.
inline constexpr unsigned kPatienceSeconds = 120;

// A multicast group on lo that no other process uses: tests run at the same time.
class TestGroup {
 public:
  explicit TestGroup(int number = 0)
      : group_("239.255." + std::to_string(getpid() / 256 % 256) + '.' + std::to_string(getpid() % 256)),
        port_(static_cast<std::uint16_t>(20'000 + number)) {}

  [[nodiscard]] std::string Url(const std::string& options = "", const std::string& interface = "lo") const {
    return "udpm://" + group_ + ':' + std::to_string(port_) + "?ttl=0&interface=" + interface + options;
  }
  [[nodiscard]] sockaddr_in Address() const {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port_);
    inet_pton(AF_INET, group_.c_str(), &address.sin_addr);
    return address;
  }

 private:
  std::string group_;
  std::uint16_t port_;
};

// Sends datagrams to a group. What it has sent can be received at once.
class TestSender {
 public:
  explicit TestSender(const TestGroup& group)
      : to_(group.Address()), socket_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    ip_mreqn outgoing{};
    outgoing.imr_ifindex = static_cast<int>(if_nametoindex("lo"));
    EXPECT_EQ(setsockopt(socket_.get(), IPPROTO_IP, IP_MULTICAST_IF, &outgoing, sizeof outgoing), 0);
  }

  // After it has sent.
  [[nodiscard]] std::uint16_t port() const {
    sockaddr_in own{};
    socklen_t size = sizeof own;
    getsockname(socket_.get(), reinterpret_cast<sockaddr*>(&own), &size);
    return ntohs(own.sin_port);
  }
  void SendDatagram(Bytes datagram) const {
    ASSERT_EQ(sendto(socket_.get(), datagram.data(), datagram.size(), 0, reinterpret_cast<const sockaddr*>(&to_),
                     sizeof to_),
              static_cast<ssize_t>(datagram.size()));
  }
  // Sends a message with the next number, behind `missing` messages that are not sent.
  void Send(std::string_view channel, std::string_view text, std::uint32_t missing = 0) {
    number_ += missing;
    SendDatagram(ShortDatagram(number_++, channel, text));
  }

 private:
  sockaddr_in to_;
  Descriptor socket_;
  std::uint32_t number_ = 0;
};

// Writes a log and returns the URL by which liblcm plays it. Events with the same time come together. After the last event, the
// source fails.
inline std::string WriteSource(const std::string& path, const std::vector<LogEvent>& events) {
  std::vector<std::uint8_t> log;
  for (const LogEvent& event : events) AppendEvent(log, event);
  std::ofstream(path, std::ios::binary) << AsText(log);
  return "file://" + path;
}

// The time of an event that liblcm does not play during a test.
inline constexpr std::int64_t kMuchLater = std::int64_t{3'600} * 1'000'000;

}  // namespace axlecast
