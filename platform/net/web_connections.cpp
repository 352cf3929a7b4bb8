#include "platform/net/web_connections.h"

#include <arpa/inet.h>

#include <algorithm>
#include <array>

namespace axlecast {

WebConnections::Admission WebConnections::Admit(const std::string& address, MonoNs now) {
  const bool address_full = !address.empty() && Count(&address) >= limits_.per_address;
  if (!address_full && Count(nullptr) < limits_.total) return {.admitted = true};
  const auto slowest = Slowest(address_full ? &address : nullptr, now);
  if (slowest == connections_.end()) return {};
  slowest->second.phase = Phase::kClosing;
  return {.admitted = true, .close = slowest->first};
}

void WebConnections::Add(Id id, const std::string& address, MonoNs now) {
  connections_[id] = {.address = address, .phase = Phase::kRequest, .since = now};
}

void WebConnections::Enter(Id id, Phase phase, MonoNs now) {
  const auto found = connections_.find(id);
  if (found == connections_.end() || found->second.phase == Phase::kClosing) return;
  found->second.phase = phase;
  found->second.since = now;
}

std::vector<WebConnections::Id> WebConnections::ToClose(MonoNs now) {
  std::vector<Id> ids;
  for (auto& [id, connection] : connections_) {
    const MonoNs age = now - connection.since;
    if ((connection.phase == Phase::kRequest && age >= kRequest) ||
        (connection.phase == Phase::kAnswer && age >= kAnswer)) {
      connection.phase = Phase::kClosing;
    }
    if (connection.phase == Phase::kClosing) ids.push_back(id);
  }
  return ids;
}

// Counts the connections of one address, or (null) of all.
std::size_t WebConnections::Count(const std::string* address) const {
  return static_cast<std::size_t>(std::count_if(connections_.begin(), connections_.end(), [&](const auto& entry) {
    return entry.second.phase != Phase::kClosing && (address == nullptr || entry.second.address == *address);
  }));
}

// Returns the connection that has waited longest for a complete request; without one, the one with the slowest answer.
WebConnections::Table::iterator WebConnections::Slowest(const std::string* address, MonoNs now) {
  auto slowest = connections_.end();
  for (auto i = connections_.begin(); i != connections_.end(); ++i) {
    const Connection& connection = i->second;
    if (address != nullptr && connection.address != *address) continue;
    const bool slow_answer = connection.phase == Phase::kAnswer && now - connection.since >= kSlowAnswer;
    if (connection.phase != Phase::kRequest && !slow_answer) continue;
    const bool slower = slowest == connections_.end() || connection.phase < slowest->second.phase ||
                        (connection.phase == slowest->second.phase && connection.since < slowest->second.since);
    if (slower) slowest = i;
  }
  return slowest;
}

std::string WebAddressKey(const std::string& text) {
  in_addr v4{};
  std::array<unsigned char, 16> bytes{};
  if (inet_pton(AF_INET, text.c_str(), &v4) != 1) {
    if (inet_pton(AF_INET6, text.c_str(), bytes.data()) != 1) return text;
    const bool mapped = std::all_of(bytes.begin(), bytes.begin() + 10, [](auto byte) { return byte == 0; }) &&
                        bytes[10] == 0xFF && bytes[11] == 0xFF;
    if (!mapped) {
      if (text == "::1") return "";
      std::fill(bytes.begin() + 8, bytes.end(), 0);
      std::array<char, INET6_ADDRSTRLEN> name{};
      return std::string(inet_ntop(AF_INET6, bytes.data(), name.data(), name.size())) + "/64";
    }
    std::copy(bytes.begin() + 12, bytes.end(), reinterpret_cast<unsigned char*>(&v4));
  }
  if ((ntohl(v4.s_addr) >> 24) == 127) return "";
  std::array<char, INET_ADDRSTRLEN> name{};
  return inet_ntop(AF_INET, &v4, name.data(), name.size());
}

}  // namespace axlecast
