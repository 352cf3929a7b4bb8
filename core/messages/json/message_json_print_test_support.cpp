// Encoded messages in, as hex, one a line; "<type> <json>" out. For message_json_peer_test.py.

#include <iostream>
#include <string>
#include <vector>

#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"

int main() {
  for (std::string line; std::getline(std::cin, line);) {
    std::vector<std::uint8_t> bytes;
    for (std::size_t at = 0; at + 1 < line.size(); at += 2) {
      bytes.push_back(static_cast<std::uint8_t>(std::stoul(line.substr(at, 2), nullptr, 16)));
    }
    std::string type;
    const auto json = axlecast::DecodeToJson(bytes, &type);
    std::cout << (json ? type + ' ' + axlecast::JsonLine(*json) : std::string("none")) << '\n';
  }
}
