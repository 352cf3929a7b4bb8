#include "tools/axlecast/logs/log_machine.h"

#include "core/config/load.h"
#include "tools/log/log_event.h"
#include "tools/log/log_reader.h"

namespace axlecast {

std::optional<MachineConfig> MachineOf(Bytes log, const std::string& file, std::string& problem) {
  constexpr int kHeaderEvents = 100;
  LogReader reader(log);
  for (int i = 0; i < kHeaderEvents; ++i) {
    const auto event = reader.Next();
    if (!event) break;
    if (event->channel != kMachineChannel) continue;
    ConfigErrors errors(file + ": " + std::string(kMachineChannel));
    auto machine = ParseConfig(std::string(event->data.begin(), event->data.end()), errors);
    if (!machine) problem = errors.Text();
    return machine;
  }
  problem = file + " does not hold the machine's file, as a log of `axlecast record` does: give it by --config\n";
  return std::nullopt;
}

}  // namespace axlecast
