#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace axlecast {

// The topics of one edge node. Specification 3.0.0, chapter 4.
class SparkplugTopics {
 public:
  // `primary_host`: empty if the node waits for no host.
  SparkplugTopics(const std::string& group, const std::string& node, const std::string& primary_host);

  // `message`: "NBIRTH", "NDATA", "NDEATH".
  [[nodiscard]] std::string OfNode(std::string_view message) const;
  // `message`: "DBIRTH", "DDATA", "DDEATH".
  [[nodiscard]] std::string OfDevice(std::string_view message, std::string_view device) const;
  [[nodiscard]] const std::string& node_command() const { return node_command_; }
  [[nodiscard]] const std::string& host_state() const { return host_state_; }  // empty without a primary host

  enum class Received : std::uint8_t { kNodeCommand, kHostState, kOther };
  // Compares the whole topic, because the third level of a STATE topic is not the type of a message.
  [[nodiscard]] Received KindOf(std::string_view topic) const;

 private:
  std::string group_;
  std::string node_;
  std::string node_command_;
  std::string host_state_;
};

}  // namespace axlecast
