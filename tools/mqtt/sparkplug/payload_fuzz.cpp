#include <cstdlib>

#include "tools/mqtt/sparkplug/host_state.h"
#include "tools/mqtt/sparkplug/payload.h"
#include "tools/mqtt/sparkplug/sparkplug_topics.h"

// Bytes of a broker, as the payload of an NCMD, as the payload of a STATE message and as a topic.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  if (const auto metrics = axlecast::DecodePayload(bytes); metrics && metrics->size() > size) std::abort();
  if (const auto state = axlecast::ParseHostState(bytes); state && state->timestamp_ms < 0) std::abort();
  static_cast<void>(axlecast::SparkplugTopics("group", "node", "host").KindOf(bytes));
  return 0;
}
