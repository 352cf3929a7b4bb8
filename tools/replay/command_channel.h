#pragma once

#include <string_view>

#include "core/base/inline_bytes.h"

namespace axlecast {

// Where a message on a channel of this name would be taken for a command, a permit, or the dialogue about one.
enum class CommandChannel {
  kNone,
  kBehindPrefix,  // by a machine with a prefix that the name begins with: if the message is of such a type
  kPlain,         // the channel's own name
};
[[nodiscard]] CommandChannel JudgeCommandChannel(std::string_view channel);

// Whether the message is of a type that commands, permits and their answers are made of.
[[nodiscard]] bool IsCommandMessage(Bytes message);

}  // namespace axlecast
