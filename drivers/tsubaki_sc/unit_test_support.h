#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace axlecast::tsubaki_sc {

using ByteList = std::vector<std::uint8_t>;

// The CRC as "SC unit communication guidelines", 4, notes 1 to 7 calculate it.
inline ByteList WithCrc(ByteList bytes) {
  unsigned crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int shift = 0; shift < 8; ++shift) {
      const bool carry = (crc & 1U) != 0;
      crc >>= 1U;
      if (carry) crc ^= 0xA001U;
    }
  }
  bytes.push_back(static_cast<std::uint8_t>(crc & 0xFFU));
  bytes.push_back(static_cast<std::uint8_t>(crc >> 8U));
  return bytes;
}

// A unit for the tests of the driver, written down from the guideline alone: its registers, its login, its trips.
class TestUnit {
 public:
  std::uint8_t address = 1;
  bool mains_60hz = false;
  bool stop_coil = false;
  bool logged_in = false;
  bool login_toggles = true;                   // a password written while logged in logs out
  std::string password = "password";           // guideline 2: the default
  std::map<unsigned, std::uint16_t> inputs;    // AI
  std::map<unsigned, std::uint16_t> holdings;  // AO 0-54, 300-301, 350-354
  int starts = 0;
  int stops = 0;
  int login_writes = 0;
  int clears = 0;

  TestUnit() {
    for (unsigned i = 0; i <= 8; ++i) inputs[i] = static_cast<std::uint16_t>(1000 + i);
    const std::uint16_t live[] = {2005, 1234, 4567, 351, 0xFF9C, 25, 981};  // 200.5 V 1.234 A 456.7 W 35.1 ...
    for (unsigned i = 0; i < 7; ++i) inputs[100 + i] = live[i];
    for (unsigned i = 200; i <= 204; ++i) inputs[i] = 0;
    for (unsigned log = 1; log <= 3; ++log) {
      for (unsigned quantity = 0; quantity < 7; ++quantity) {
        for (unsigned i = 0; i < 20; ++i) inputs[1000 * log + 100 * quantity + i] = 0;
      }
    }
    for (unsigned i = 0; i <= 54; ++i) holdings[i] = static_cast<std::uint16_t>(10 + i);
    holdings[54] = 2;  // 0.2 s
    SetText(300, "SC02");
    SetText(350, "T123456789");
  }

  void SetText(unsigned first, const std::string& text) {
    for (std::size_t i = 0; i + 1 < text.size(); i += 2) {
      holdings[first + static_cast<unsigned>(i / 2)] = static_cast<std::uint16_t>((text[i] << 8) | text[i + 1]);
    }
  }

  // The logs shift 1 -> 2 -> 3; every sample of the new one holds `mark`.
  void Trip(std::uint16_t factor, std::uint16_t mark) {
    for (unsigned quantity = 0; quantity < 7; ++quantity) {
      for (unsigned i = 0; i < 20; ++i) {
        const unsigned at = 100 * quantity + i;
        inputs[3000 + at] = inputs[2000 + at];
        inputs[2000 + at] = inputs[1000 + at];
        inputs[1000 + at] = mark;
      }
    }
    inputs[204] = inputs[203];
    inputs[203] = inputs[202];
    inputs[202] = factor;
    inputs[201] = factor;
    ++inputs[200];
  }
  void ClearTrip() { inputs[201] = 0; }

  void PowerCycle() {
    logged_in = false;
    stop_coil = false;
  }

  // What it answers; nothing when it does not.
  ByteList Answer(const ByteList& request) {
    if (request.size() < 4 || request[0] != address) return {};
    const ByteList body(request.begin(), request.end() - 2);
    if (WithCrc(body) != request) return {};
    switch (request[1]) {
      case 0x01:
        return Read(
            body, [&](unsigned at) { return at == 0 || at == 100 || at == 200; }, true,
            [&](unsigned at) { return std::uint16_t(at == 100 && stop_coil); });
      case 0x02:
        return Read(
            body, [](unsigned at) { return at == 0; }, true, [&](unsigned) { return std::uint16_t(mains_60hz); });
      case 0x03:
        return ReadHolding(body);
      case 0x04:
        if (Word(body, 2) == 300 && Word(body, 4) == 1) inputs[300] = logged_in ? 0xFF00 : 0x0000;
        return Read(
            body, [&](unsigned at) { return inputs.count(at) != 0; }, false,
            [&](unsigned at) { return inputs[at]; });
      case 0x05:
        return WriteCoil(body);
      case 0x06:
        return WriteRegisters(body, Word(body, 2), {Word(body, 4)});
      case 0x10:
        return WriteMany(body);
      case 0x11:
        return WithCrc({address, 0x11, 0x01, 0x00});  // guideline 12
      default:
        return Error(body, 1);
    }
  }

  static std::uint16_t Word(const ByteList& bytes, std::size_t at) {
    return static_cast<std::uint16_t>((bytes.at(at) << 8) | bytes.at(at + 1));
  }

 private:
  ByteList Error(const ByteList& body, std::uint8_t code) const {
    return WithCrc({address, static_cast<std::uint8_t>(body[1] | 0x80), code});
  }

  ByteList Read(const ByteList& body, const std::function<bool(unsigned)>& known, bool bits,
                const std::function<std::uint16_t(unsigned)>& value) const {
    const unsigned first = Word(body, 2);
    const unsigned count = Word(body, 4);
    for (unsigned at = first; at < first + count; ++at) {
      if (!known(at)) return Error(body, 2);
    }
    ByteList reply = {address, body[1]};
    if (bits) {
      reply.push_back(1);
      reply.push_back(static_cast<std::uint8_t>(value(first)));
    } else {
      reply.push_back(static_cast<std::uint8_t>(2 * count));
      for (unsigned at = first; at < first + count; ++at) {
        reply.push_back(static_cast<std::uint8_t>(value(at) >> 8));
        reply.push_back(static_cast<std::uint8_t>(value(at) & 0xFF));
      }
    }
    return WithCrc(reply);
  }

  ByteList ReadHolding(const ByteList& body) {
    const unsigned first = Word(body, 2);
    const unsigned count = Word(body, 4);
    // Guideline 7, note 1: these only as a whole.
    const std::map<unsigned, unsigned> whole = {{100, 8}, {200, 8}, {300, 2}, {350, 5}};
    const auto block = whole.find(first);
    const bool parameters = first + count <= 55;
    if (!parameters && (block == whole.end() || block->second != count)) return Error(body, 2);
    if (first == 200 && !logged_in) return Error(body, 4);
    std::map<unsigned, std::uint16_t> texts = holdings;
    for (unsigned i = 0; i < 8; ++i) {
      texts[100 + i] = 0;
      const auto c = [&](unsigned at) {
        return at < password.size() ? std::uint8_t(password[at]) : std::uint8_t{0};
      };
      texts[200 + i] = static_cast<std::uint16_t>((c(2 * i) << 8) | c(2 * i + 1));
    }
    return Read(
        body, [](unsigned) { return true; }, false, [&](unsigned at) { return texts.at(at); });
  }

  ByteList WriteCoil(const ByteList& body) {
    const unsigned coil = Word(body, 2);
    const unsigned value = Word(body, 4);
    if (coil != 0 && coil != 100 && coil != 200) return Error(body, 2);
    if (value != 0xFF00 && value != 0x0000) return Error(body, 3);
    if (!logged_in) return Error(body, 4);
    if (value == 0xFF00) Act(coil);
    return WithCrc(body);
  }

  void Act(unsigned coil) {
    if (coil == 0) {
      inputs[200] = 0;
      ++clears;
    } else if (coil == 100) {
      stop_coil = true;
      ++stops;
    } else if (inputs[201] == 0) {
      stop_coil = false;
      ++starts;
    }
  }

  ByteList WriteMany(const ByteList& body) {
    const unsigned first = Word(body, 2);
    const unsigned count = Word(body, 4);
    if (body.size() != 7 + 2 * count || body[6] != 2 * count) return Error(body, 3);
    std::vector<std::uint16_t> values;
    std::string text;
    for (unsigned i = 0; i < count; ++i) {
      values.push_back(Word(body, 7 + 2 * i));
      text += static_cast<char>(values.back() >> 8);
      text += static_cast<char>(values.back() & 0xFF);
    }
    text.erase(text.find_last_not_of(std::string(" \0", 2)) + 1);
    ByteList reply(body.begin(), body.begin() + 6);
    if (first == 100 && count == 8) {
      ++login_writes;
      if (text.size() < 8) return Error(body, 3);
      if (text != password) return Error(body, 4);
      logged_in = login_toggles ? !logged_in : true;
      return WithCrc(reply);
    }
    if (first == 200 && count == 8) {
      if (text.size() < 8) return Error(body, 3);
      if (!logged_in) return Error(body, 4);
      password = text;
      return WithCrc(reply);
    }
    return WriteRegisters(body, first, values);
  }

  ByteList WriteRegisters(const ByteList& body, unsigned first, const std::vector<std::uint16_t>& values) {
    if (first + values.size() > 55) return Error(body, 2);
    if (!logged_in) return Error(body, 4);
    for (std::size_t i = 0; i < values.size(); ++i) holdings[first + static_cast<unsigned>(i)] = values[i];
    return WithCrc({body.begin(), body.begin() + 6});
  }
};

}  // namespace axlecast::tsubaki_sc
