// The frames that our codecs make, and what they take from a Modbus reply, for test_codecs.py and test_modbus.py.
//
// Reads one order per line and prints one line for each:
//
//   tformat ID | tformat_cell ADDRESS | tformat_write ADDRESS DATA            the request in hex
//   saa_serial COMMAND                                                        likewise
//   saa_can COMMAND NODE PARAMETER | saa_can_node NODE | saa_can_rate CODE    identifier#data
//   saa_modbus_read ADDRESS REGISTERS | saa_modbus_query | saa_modbus_address ADDRESS NEW | saa_modbus_set ADDRESS PARAMETER
//   read FUNCTION ADDRESS START COUNT | coil ADDRESS COIL ON | register ADDRESS START VALUE | registers ADDRESS START VALUE...
//   check REQUEST REPLY        "ok DATA" with the bytes of a read, or the error, and the code of an exception
//
// Numbers are decimal; REQUEST and REPLY are hex, "-" without bytes.

#include <cstdio>
#include <functional>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "core/device/reading.h"
#include "drivers/protocol/modbus/adu.h"
#include "drivers/saa_can/codec.h"
#include "drivers/saa_modbus/codec.h"
#include "drivers/saa_serial/codec.h"
#include "drivers/tformat/codec.h"

namespace axlecast {
namespace {

using Numbers = std::vector<unsigned>;

std::uint8_t Byte(unsigned number) { return static_cast<std::uint8_t>(number); }
std::uint16_t Word(unsigned number) { return static_cast<std::uint16_t>(number); }

std::string Hex(Bytes bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    char digits[3];
    std::snprintf(digits, sizeof digits, "%02x", byte);
    text += digits;
  }
  return text;
}

std::vector<std::uint8_t> OfHex(const std::string& text) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i + 1 < text.size(); i += 2)
    bytes.push_back(static_cast<std::uint8_t>(std::stoul(text.substr(i, 2), nullptr, 16)));
  return bytes;
}

std::string Candump(const CanFrame& frame) {
  char identifier[12];
  std::snprintf(identifier, sizeof identifier, "%03X#", static_cast<unsigned>(frame.id));
  return identifier + Hex(frame.data);
}

std::string Registers(const Numbers& n) {
  std::vector<std::uint16_t> values;
  for (std::size_t i = 2; i < n.size(); ++i) values.push_back(Word(n[i]));
  return Hex(modbus::WriteRegisters(Byte(n.at(0)), Word(n.at(1)), values));
}

using Make = std::function<std::string(const Numbers&)>;

const std::map<std::string, Make>& Orders() {
  static const std::map<std::string, Make> kOrders = {
      {"tformat", [](const Numbers& n) { return Hex(tformat::Request(static_cast<tformat::DataId>(n.at(0)))); }},
      {"tformat_cell", [](const Numbers& n) { return Hex(tformat::EepromReadRequest(Byte(n.at(0)))); }},
      {"tformat_write",
       [](const Numbers& n) { return Hex(tformat::EepromWriteRequest(Byte(n.at(0)), Byte(n.at(1)))); }},
      {"saa_serial", [](const Numbers& n) { return Hex(saa_serial::Request(Byte(n.at(0)))); }},
      {"saa_can",
       [](const Numbers& n) {
         return Candump(
             saa_can::CommandFrame(static_cast<saa_can::Command>(n.at(0)), Byte(n.at(1)), Byte(n.at(2))));
       }},
      {"saa_can_node", [](const Numbers& n) { return Candump(saa_can::NodeFrame(Byte(n.at(0)))); }},
      {"saa_can_rate", [](const Numbers& n) { return Candump(saa_can::BitrateFrame(Byte(n.at(0)))); }},
      {"saa_modbus_read",
       [](const Numbers& n) { return Hex(saa_modbus::ReadRequest(Byte(n.at(0)), static_cast<int>(n.at(1)))); }},
      {"saa_modbus_query", [](const Numbers&) { return Hex(saa_modbus::QueryRequest()); }},
      {"saa_modbus_address",
       [](const Numbers& n) { return Hex(saa_modbus::SetAddressRequest(Byte(n.at(0)), Byte(n.at(1)))); }},
      {"saa_modbus_set",
       [](const Numbers& n) {
         return Hex(saa_modbus::SetParameterRequest(Byte(n.at(0)), static_cast<saa_modbus::Parameter>(n.at(1))));
       }},
      {"read",
       [](const Numbers& n) {
         return Hex(
             modbus::Read(Byte(n.at(1)), static_cast<modbus::Function>(n.at(0)), Word(n.at(2)), Word(n.at(3))));
       }},
      {"coil", [](const Numbers& n) { return Hex(modbus::WriteCoil(Byte(n.at(0)), Word(n.at(1)), n.at(2) != 0)); }},
      {"register",
       [](const Numbers& n) { return Hex(modbus::WriteRegister(Byte(n.at(0)), Word(n.at(1)), Word(n.at(2)))); }},
      {"registers", Registers},
  };
  return kOrders;
}

std::string CheckReply(std::istream& line) {
  std::string request;
  std::string reply;
  line >> request >> reply;
  const std::vector<std::uint8_t> asked = OfHex(request);
  const std::vector<std::uint8_t> answered = OfHex(reply);
  const modbus::Reply checked = modbus::Check(asked, answered);
  if (checked.ok()) return "ok " + Hex(checked.data);
  std::string text = kErrorNames.at(static_cast<std::size_t>(*checked.error));
  if (checked.error == ErrorKind::kException) text += ' ' + std::to_string(checked.exception);
  return text;
}

std::string Answer(const std::string& text) {
  std::istringstream line(text);
  std::string order;
  line >> order;
  if (order == "check") return CheckReply(line);
  Numbers numbers;
  for (unsigned number = 0; line >> number;) numbers.push_back(number);
  return Orders().at(order)(numbers);
}

}  // namespace
}  // namespace axlecast

int main() {
  for (std::string line; std::getline(std::cin, line);) std::cout << axlecast::Answer(line) << '\n';
  return std::cout.flush() ? 0 : 1;
}
