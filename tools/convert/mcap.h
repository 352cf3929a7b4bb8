#pragma once

#include "tools/convert/conversion.h"
#include "tools/convert/event_range.h"

namespace axlecast {

// The events as an MCAP file: a channel's name is its topic. Messages of ours are JSON with a JSON Schema
// ("axlecast.position_t"); others, and malformed ones, stay as they are, with message encoding "lcm" and without a
// schema. log_time is the reception, publish_time the message's `utime`. The log's own texts (tools/log/log_header.h)
// become attachments; its seals, which speak of its bytes, are left out.
[[nodiscard]] Conversion WriteMcap(const EventRange& events, const Output& out);

}  // namespace axlecast
