#pragma once

#include "tools/convert/conversion.h"

namespace axlecast {

// Writes the events as an MCAP file, with the name of the channel as topic:
// - Messages of axlecast are JSON with a JSON Schema ("axlecast.position_t").
// - Malformed messages and messages of other programs are copied, with message encoding "lcm" and without a schema.
// - log_time is the time of reception, publish_time the message's `utime`.
// - The log's own texts (tools/log/log_event.h) become attachments. Its seals refer to bytes of the log: left out.
[[nodiscard]] Conversion WriteMcap(const EventRange& events, const Output& out);

}  // namespace axlecast
