#include "tools/log/log_header.h"

#include "tools/log/log_seal.h"

namespace axlecast {

bool IsLogChannel(std::string_view channel) {
  return channel == kMachineChannel || channel == kSchemaChannel || channel == kRecorderChannel ||
         channel == kSealChannel;
}

}  // namespace axlecast
