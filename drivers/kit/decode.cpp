#include "drivers/kit/decode.h"

#include "core/device/operation.h"

namespace axlecast {

Result<> ApplySettings(std::string_view family, const DecodeSettings& settings,
                       std::span<const DecodeOption> options) {
  for (const auto& [key, value] : settings) {
    const auto option = std::find_if(options.begin(), options.end(),
                                     [&name = key](const DecodeOption& known) { return known.key == name; });
    if (option == options.end()) {
      std::string text = "unknown key '" + key + "': " + std::string(family) + " accepts ";
      for (std::size_t i = 0; i < options.size(); ++i) {
        if (i > 0) text += i + 1 < options.size() ? ", " : " and ";
        text += options[i].key;
      }
      return Failure(std::move(text));
    }
    if (!option->set(value)) return Failure(key + '=' + value + ": expected " + option->expected);
  }
  return {};
}

std::string HexByte(std::uint8_t byte) { return Text("0x%02x", unsigned{byte}); }

}  // namespace axlecast
