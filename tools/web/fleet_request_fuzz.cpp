#include <cstdlib>

#include "core/messages/json/field.h"
#include "tools/web/fleet_request.h"

// Any question is refused with a reason, or is within its limits.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  nlohmann::ordered_json json =
      axlecast::ParseOutsideJson(std::string_view(reinterpret_cast<const char*>(data), size));
  if (!json.is_object() || !json.contains("type") || !json["type"].is_string()) return 0;
  const axlecast::Result<axlecast::FleetRequest> request = axlecast::ParseFleetRequest(json);
  if (!request) {
    if (request.error().text.empty()) std::abort();
    return 0;
  }
  using Kind = axlecast::FleetRequest::Kind;
  if (request->id < 0 || request->id > axlecast::kMaxFleetId) std::abort();
  if (request->machine.size() > axlecast::kMaxFleetName || request->device.size() > axlecast::kMaxFleetName) {
    std::abort();
  }
  if ((request->kind == Kind::kMachines) != request->machine.empty()) std::abort();
  if (request->kind == Kind::kMachines || request->kind == Kind::kDevices) return 0;
  if (request->from < 0 || request->from >= request->to || request->to > axlecast::kLatestFleetUtime) std::abort();
  if (request->kind == Kind::kCurve && axlecast::FindCurveColumn(request->column) == nullptr) std::abort();
  return 0;
}
