#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <linux/if_packet.h>
#include <net/ethernet.h>
#include <net/if.h>
#include <poll.h>
#include <sys/socket.h>

#include <array>
#include <cstdlib>
#include <string>
#include <vector>

#include "core/base/inline_bytes.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// Runs a line of sh(1) that must succeed: these tests run in a network of their own.
inline void Shell(const std::string& line) {
  ASSERT_EQ(std::system(line.c_str()), 0) << line;
}  // NOLINT(cert-env33-c)

// Makes a link whose ends are the interfaces `name` and `name`x, with an address for `name`. Its other end is the network. The
// IPv6 addresses can be used at once: the kernel does not look for duplicates first, which takes 1 to 2 s.
inline void MakeLink(const std::string& name, const std::string& address) {
  Shell("echo 0 >/proc/sys/net/ipv6/conf/default/accept_dad && ip link add " + name + " type veth peer name " +
        name + "x && ip link set " + name + "x up && ip address add " + address + " dev " + name +
        " && ip link set " + name + " up");
}

// All links of a test, deleted at its end.
class Links {
 public:
  Links() = default;
  Links(const Links&) = delete;
  Links& operator=(const Links&) = delete;
  ~Links() {
    for (const char* name : {"net1", "net2"}) {
      static_cast<void>(
          std::system((std::string("ip link del ") + name + " 2>/dev/null").c_str()));  // NOLINT(cert-env33-c)
    }
  }
};

// Receives what arrives at an interface from its link, as a device of the network would.
class LinkCapture {
 public:
  explicit LinkCapture(const std::string& interface)
      : socket_(socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, htons(ETH_P_ALL))) {
    sockaddr_ll place{};
    place.sll_family = AF_PACKET;
    place.sll_protocol = htons(ETH_P_ALL);
    place.sll_ifindex = static_cast<int>(if_nametoindex(interface.c_str()));
    EXPECT_EQ(bind(socket_.get(), reinterpret_cast<const sockaddr*>(&place), sizeof place), 0);
  }

  // Returns the number of frames so far that contain `text`.
  int Count(const std::string& text) {
    std::array<char, 2'048> frame;
    for (ssize_t size = 0; (size = recv(socket_.get(), frame.data(), frame.size(), 0)) > 0;) {
      frames_.emplace_back(frame.data(), static_cast<std::size_t>(size));
    }
    int count = 0;
    for (const std::string& each : frames_) count += each.find(text) != std::string::npos ? 1 : 0;
    return count;
  }

 private:
  Descriptor socket_;
  std::vector<std::string> frames_;
};

}  // namespace axlecast
