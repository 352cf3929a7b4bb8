#include "tools/axlecast/decode/decode_command.h"

#include <algorithm>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "core/base/result.h"
#include "core/device/family.h"
#include "core/messages/json/field.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/decode/frame_text.h"

namespace axlecast {
namespace {

// Longer than any frame. Limits the memory for a file without line ends.
constexpr std::size_t kMaxLine = 64 * 1024;

constexpr const char* kExamples =
    "Input: two hex digits per byte. Blanks, commas, colons, semicolons, dashes and 0x are allowed between bytes.\n"
    "One quoted argument is one frame. Without arguments, each line of standard input is one. Blank lines and\n"
    "comments after # are skipped. CAN frames: ID#DATA, or a line of candump. With --bits: the digits 0 and 1 in\n"
    "the order in which they were clocked in.\n"
    "\n"
    "Output: one JSON object per frame. Exit code: 0 all good, 1 any bad, 2 wrong usage.\n"
    "\n"
    "Examples:\n"
    "  axlecast decode tformat \"1A 00 A5 A5 00 17 88 88 00 00 0D\"\n"
    "  axlecast decode tformat --set bits=23 --set enid=0x17 0220D6431AAD \"EA 00 EA\"\n"
    "  axlecast decode tformat --set bits=23 < capture.txt | jq .angle_deg\n"
    "  axlecast decode ssi --set bits=12 --bits 000111101111\n"
    "  axlecast decode saa-can \"120#4726000000000000\"";

// Setting of a frame that was written as bits: its length in bits.
constexpr const char* kBitCount = "bit_count";

// Decodes frames one by one with the settings of the command line, and writes one JSON object for each to `out`.
class FrameDecoder {
 public:
  FrameDecoder(const Family& family, DecodeSettings settings, bool bits, std::ostream& out)
      : family_(family), settings_(std::move(settings)), bits_(bits), out_(out) {}

  // Fails if the family refuses the settings.
  [[nodiscard]] Result<> CheckSettings() const {
    const auto decoded = family_.decode(bits_ ? WithBitCount(0) : settings_, {});
    if (!decoded) return Failure(decoded.error());
    return {};
  }

  // `where` precedes the column in an error.
  void Decode(const std::string& text, const std::string& where) {
    if (bits_) return DecodeBits(text, where);
    const Result<FrameBytes> bytes = ReadBytes(text);
    if (!bytes) return Bad("not_hex", where + bytes.error().text);
    Show(settings_, *bytes);
  }

  void Bad(const std::string& error, const std::string& detail) {
    all_good_ = false;
    out_ << JsonLine({{"ok", false}, {"kind", "unknown"}, {"error", error}, {"detail", detail}}) << '\n';
  }

  [[nodiscard]] bool all_good() const { return all_good_; }
  [[nodiscard]] bool can_write() const { return out_.good(); }

 private:
  [[nodiscard]] Result<FrameBytes> ReadBytes(const std::string& text) const {
    if (family_.link == LinkKind::kCan) {
      if (auto packet = ParseCanNotation(text)) return *std::move(packet);
    }
    return ParseHexLine(text);
  }

  void DecodeBits(const std::string& text, const std::string& where) {
    const Result<BitLine> line = ParseBitLine(text);
    if (!line) return Bad("not_bits", where + line.error().text);
    bit_count_ = line->bits;
    Show(WithBitCount(line->bits), line->bytes);
  }

  [[nodiscard]] DecodeSettings WithBitCount(std::size_t bits) const {
    DecodeSettings settings = settings_;
    settings.emplace_back(kBitCount, std::to_string(bits));
    return settings;
  }

  void Show(const DecodeSettings& settings, Bytes frame) {
    nlohmann::ordered_json json = family_.decode(settings, frame).value();
    if (json.value("error", "") == "short") json["detail"] = ShortText(frame);
    all_good_ = all_good_ && json.at("ok").get<bool>();
    out_ << JsonLine(json) << '\n';
  }

  // Returns the received and the required length. The required length is found by decoding longer and longer frames.
  [[nodiscard]] std::string ShortText(Bytes frame) const {
    constexpr std::size_t kMaxMore = 300;  // bytes; more than the longest frame has
    std::vector<std::uint8_t> longer(frame.begin(), frame.end());
    const char* const unit = bits_ ? " bits" : " bytes";
    const std::size_t received = bits_ ? bit_count_ : frame.size() - HeadBytes(frame);
    for (std::size_t more = 1; more <= (bits_ ? 8 : 1) * kMaxMore; ++more) {
      longer.resize(bits_ ? std::max(frame.size(), (received + more + 7) / 8) : frame.size() + more);
      const nlohmann::ordered_json json =
          family_.decode(bits_ ? WithBitCount(received + more) : settings_, longer).value();
      if (json.value("error", "") == "short") continue;
      const std::string kind = json.value("kind", "unknown");
      return std::to_string(received) + unit + " received, at least " + std::to_string(received + more) +
             " are needed" + (kind == "unknown" ? "" : " for a " + kind);
    }
    return std::to_string(received) + unit + " received, more are needed";
  }

  // Returns the number of bytes before the data: a CAN frame begins with its identifier.
  [[nodiscard]] std::size_t HeadBytes(Bytes frame) const {
    constexpr std::size_t kIdentifier = 4;
    return family_.link == LinkKind::kCan && frame.size() >= kIdentifier ? kIdentifier : 0;
  }

  const Family& family_;
  DecodeSettings settings_;
  const bool bits_;
  std::ostream& out_;
  std::size_t bit_count_ = 0;  // of the current frame
  bool all_good_ = true;
};

struct Line {
  std::string text;
  bool cut = false;  // longer than kMaxLine; the rest was skipped
};

std::optional<Line> ReadLine(std::istream& in) {
  Line line;
  bool any = false;
  for (int c = in.get(); c != std::istream::traits_type::eof(); c = in.get()) {
    any = true;
    if (c == '\n') return line;
    line.cut = line.text.size() == kMaxLine;
    if (!line.cut) line.text += static_cast<char>(c);
  }
  return any ? std::optional(std::move(line)) : std::nullopt;
}

bool IsBlank(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  return first == std::string::npos || text[first] == '#';
}

// Returns the number of frames.
std::size_t DecodeLines(std::istream& in, FrameDecoder& decoder) {
  std::size_t frames = 0;
  for (std::size_t number = 1; decoder.can_write(); ++number) {
    const std::optional<Line> line = ReadLine(in);
    if (!line) break;
    if (!line->cut && IsBlank(line->text)) continue;
    ++frames;
    const std::string where = "line " + std::to_string(number) + ", ";
    if (line->cut) {
      decoder.Bad("long", where + "more than " + std::to_string(kMaxLine) + " characters");
    } else {
      decoder.Decode(line->text, where);
    }
  }
  return frames;
}

Result<DecodeSettings> SplitSettings(const std::vector<std::string>& texts) {
  DecodeSettings settings;
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0) {
      return Failure("--set '" + text + "': expected key=value, for example --set bits=17");
    }
    settings.emplace_back(text.substr(0, equals), text.substr(equals + 1));
  }
  return settings;
}

std::string KnownProtocols(std::optional<LinkKind> link = std::nullopt) {
  std::string names;
  for (const Family* family : Families()) {
    if (family->decode == nullptr || (link && family->link != *link)) continue;
    names += (names.empty() ? "" : ", ") + std::string(family->name);
  }
  return names;
}

// Returns true if the bytes of one frame seem to be separate arguments.
bool LooksUnquoted(const DecodeArguments& arguments) {
  constexpr std::size_t kMaxGroup = 8;
  return arguments.frames.size() > 1 && std::ranges::all_of(arguments.frames, [&](const std::string& frame) {
           return arguments.bits ? frame.size() <= kMaxGroup
                                 : ParseHexLine(frame).value_or(FrameBytes()).size() == 1;
         });
}

// Finds a family by its name in the machine's file, or with '-' instead of '_' as in the names of the drivers.
const Family* FamilyOf(std::string protocol) {
  std::ranges::replace(protocol, '-', '_');
  return FindFamily(protocol);
}

}  // namespace

int RunDecode(const DecodeArguments& arguments, std::istream& in, std::ostream& out, std::ostream& err) {
  const auto report = [&err](const std::string& text, int exit_code) {
    err << "axlecast decode: " << text << '\n';
    return exit_code;
  };
  const Family* family = FamilyOf(arguments.protocol);
  if (family == nullptr || family->decode == nullptr) {
    return report("unknown protocol '" + arguments.protocol + "'; known: " + KnownProtocols(), kExitUsage);
  }
  if (arguments.bits && family->link != LinkKind::kSpi) {
    return report("--bits is for devices that are clocked bit by bit (" + KnownProtocols(LinkKind::kSpi) +
                      "); frames of " + std::string(family->name) + " are bytes in hex",
                  kExitUsage);
  }
  Result<DecodeSettings> settings = SplitSettings(arguments.settings);
  if (!settings) return report(settings.error().text, kExitUsage);
  FrameDecoder decoder(*family, std::move(*settings), arguments.bits, out);
  if (const auto usable = decoder.CheckSettings(); !usable) {
    return report("--set " + usable.error().text, kExitUsage);
  }

  for (const std::string& frame : arguments.frames) decoder.Decode(frame, "");
  if (arguments.frames.empty() && DecodeLines(in, decoder) == 0 && decoder.can_write()) {
    static_cast<void>(report("no frames in the input", kExitDone));
  }
  out.flush();
  if (!out) return report("the output could not be written", kExitFailed);
  if (decoder.all_good()) return kExitDone;
  if (!LooksUnquoted(arguments)) return kExitBad;
  return report("each argument is one frame; put the groups of one frame between quotes", kExitBad);
}

void AddDecodeCommand(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<DecodeArguments>();
  CLI::App* command = app.add_subcommand("decode", "Decode captured frames off-line, one JSON object per frame");
  command->add_option("PROTOCOL", arguments->protocol, "Family of the device: " + KnownProtocols())->required();
  command
      ->add_option("--set", arguments->settings,
                   "Setting that the frame does not contain, as key=value; may be repeated")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  command->add_flag("--bits", arguments->bits, "Frames are written as bits: 1010...; families on SPI");
  command->add_option("HEX", arguments->frames, "Frames; if none is given, they are read from standard input");
  command->footer(kExamples);
  command->callback([arguments, &exit_code] {
    exit_code = RunDecode(*arguments, std::cin, std::cout, std::cerr);
    if (std::ferror(stdin) != 0) {
      std::cerr << "axlecast decode: standard input could not be read\n";
      exit_code = kExitFailed;
    }
  });
}

}  // namespace axlecast
