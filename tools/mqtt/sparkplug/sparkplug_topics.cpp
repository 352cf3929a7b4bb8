#include "tools/mqtt/sparkplug/sparkplug_topics.h"

namespace axlecast {
namespace {

const std::string kNamespace = "spBv1.0";

}  // namespace

SparkplugTopics::SparkplugTopics(const std::string& group, const std::string& node, const std::string& primary_host)
    : group_(group),
      node_(node),
      node_command_(OfNode("NCMD")),
      host_state_(primary_host.empty() ? "" : kNamespace + "/STATE/" + primary_host) {}

std::string SparkplugTopics::OfNode(std::string_view message) const {
  return kNamespace + '/' + group_ + '/' + std::string(message) + '/' + node_;
}

std::string SparkplugTopics::OfDevice(std::string_view message, std::string_view device) const {
  return OfNode(message) + '/' + std::string(device);
}

SparkplugTopics::Received SparkplugTopics::KindOf(std::string_view topic) const {
  if (topic == node_command_) return Received::kNodeCommand;
  if (!host_state_.empty() && topic == host_state_) return Received::kHostState;
  return Received::kOther;
}

}  // namespace axlecast
