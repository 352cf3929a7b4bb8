#include "tools/recorder/log_identity.h"

#include <nlohmann/json.hpp>

#include "tools/log/log_header.h"

namespace axlecast {

std::vector<std::pair<std::string, std::string>> HeaderEvents(const LogIdentity& identity, std::int64_t utime,
                                                              std::int64_t number) {
  const nlohmann::ordered_json recorder = {
      {"version", AXLECAST_VERSION}, {"name", identity.name},     {"host", identity.host}, {"urls", identity.urls},
      {"channel", identity.channel}, {"invert", identity.invert}, {"start_utime", utime},  {"file_number", number}};
  std::vector<std::pair<std::string, std::string>> events;
  // Host and name may hold bytes that are no text.
  constexpr auto kReplace = nlohmann::ordered_json::error_handler_t::replace;
  events.emplace_back(kRecorderChannel, recorder.dump(-1, ' ', false, kReplace));
  if (!identity.machine.empty()) events.emplace_back(kMachineChannel, identity.machine);
  events.emplace_back(kSchemaChannel, SchemaText());
  return events;
}

}  // namespace axlecast
