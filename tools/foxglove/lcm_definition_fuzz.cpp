#include <cstdlib>
#include <string_view>

#include "tools/foxglove/ros_schema.h"

// A line of definitions, then a message: any of both is refused, or is shown.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view input(reinterpret_cast<const char*>(data), size);
  const std::string_view text = input.substr(0, input.find('\n'));
  axlecast::LcmDefinitions definitions;
  if (const axlecast::Result<> added = definitions.Add(text); !added) {
    if (added.error().text.empty()) std::abort();
    return 0;
  }
  if (!definitions.Finish().empty()) return 0;
  const axlecast::LcmStruct* const type = definitions.Find("a");
  if (type == nullptr) return 0;
  const axlecast::RosSchema schema(definitions, *type);
  std::string cdr;
  const bool shown = schema.Transcode(axlecast::Bytes(data, size), cdr);
  if (shown && cdr.size() > 100 * size + 1'000) std::abort();
  return 0;
}
