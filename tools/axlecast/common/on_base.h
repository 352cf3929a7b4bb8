#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "client/axlecast/time_base.h"
#include "core/base/inline_bytes.h"
#include "core/base/time.h"

namespace axlecast {

// Adds to messages, as JSON, where their instant lies on the time base of their machine: `on_base` with `base_id`, `ns` and
// `half_width_ns`, or null if that is not known. Messages of a machine of which no TIME message has come get no such field.
class OnBase {
 public:
  // Takes a TIME message; others have no effect. `now`: the instant of its arrival, of the same clock as in Add.
  void Take(Bytes message, MonoNs now);
  // `line`: the fields of a message, by DecodeToJson.
  void Add(nlohmann::ordered_json& line, MonoNs now) const;

 private:
  static constexpr std::size_t kMaxMachines = 16;  // any host can invent machines

  std::map<std::string, TimeBase> bases_;  // by machine_id, as in JSON
};

}  // namespace axlecast
