#include "tools/axlecast/command/memory_cells.h"

#include <charconv>

#include "core/base/spelling.h"
#include "core/messages/json/field.h"
#include "drivers/kit/arguments.h"

namespace axlecast {
namespace {

constexpr std::string_view kKey = "eeprom_";
constexpr std::size_t kMaxCells = 65536;

std::string_view Trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

// Returns false if `key` or `bytes` is malformed. Ignores other keys.
bool AddCells(std::string_view key, std::string_view bytes, MemoryCells& cells) {
  if (!key.starts_with(kKey)) return true;
  const std::string_view digits = key.substr(kKey.size());
  std::size_t address = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), address);
  if (digits.empty() || error != std::errc() || end != digits.data() + digits.size()) return false;
  const auto data = ParseHex(bytes);
  if (!data || address > kMaxCells || data->size() > kMaxCells - address) return false;
  for (const std::uint8_t byte : *data) cells[address++] = byte;
  return true;
}

// "axis1" of "# axlecast eeprom_backup of axis1, command ...".
std::string DeviceOf(std::string_view comment) {
  constexpr std::string_view kOf = " of ";
  const std::size_t of = comment.find(kOf);
  if (of == std::string_view::npos) return "";
  const std::string_view rest = comment.substr(of + kOf.size());
  return std::string(Trimmed(rest.substr(0, rest.find(','))));
}

}  // namespace

Result<MemoryCells> CellsOf(std::span<const change_t> changes) {
  MemoryCells cells;
  for (const change_t& change : changes) {
    if (!AddCells(change.key, change.after, cells)) {
      return Failure("malformed: " + Quoted(change.key + ": " + change.after));
    }
  }
  if (cells.empty()) return Failure("no cells were read");
  return cells;
}

std::string MemoryFileText(const CommandResult& result) {
  std::string text = "# axlecast " + result.status.operation + " of " + result.status.device + ", command " +
                     HexDigits(result.id) + ", utime " + std::to_string(result.status.finished_utime) + '\n';
  for (const change_t& change : result.status.changes) text += change.key + ": " + change.after + '\n';
  return text;
}

Result<MemoryFile> ParseMemoryFile(std::string_view text) {
  MemoryFile file;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = text.find('\n');
    const std::string_view line = Trimmed(text.substr(0, end));
    text = end == std::string_view::npos ? std::string_view() : text.substr(end + 1);
    if (line.starts_with('#') && file.device.empty()) file.device = DeviceOf(line);
    if (line.empty() || line.starts_with('#')) continue;
    const std::size_t colon = line.find(':');
    const std::string_view key = Trimmed(line.substr(0, colon));
    const std::string_view bytes = colon == std::string_view::npos ? "" : Trimmed(line.substr(colon + 1));
    if (key.starts_with(kKey) && AddCells(key, bytes, file.cells)) continue;
    return Failure("line " + std::to_string(number) + " is no \"eeprom_ADDRESS: BYTES\"");
  }
  if (file.cells.empty()) return Failure("it holds no cells");
  return file;
}

std::vector<CellRun> CellRuns(const MemoryCells& present, const MemoryCells& target, std::size_t max_cells) {
  std::vector<CellRun> runs;
  for (const auto& [address, byte] : target) {
    const auto now = present.find(address);
    if (now == present.end() || now->second == byte) continue;
    const bool continues = !runs.empty() && runs.back().address + runs.back().after.size() == address &&
                           runs.back().after.size() < max_cells;
    if (!continues) runs.push_back({.address = address, .before = {}, .after = {}});
    runs.back().before.push_back(now->second);
    runs.back().after.push_back(byte);
  }
  return runs;
}

}  // namespace axlecast
