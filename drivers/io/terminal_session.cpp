#include "drivers/io/terminal_session.h"

#include <sys/stat.h>
#include <sys/sysmacros.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <system_error>

namespace axlecast {
namespace {

namespace fs = std::filesystem;

bool IsProcess(const std::string& name) { return name.find_first_not_of("0123456789") == std::string::npos; }

// proc(5), /proc/[pid]/stat: the seventh field, with the minor number in the bits 31 to 20 and 7 to 0.
dev_t ControllingTerminal(const std::string& stat_line) {
  const std::size_t name_end = stat_line.rfind(')');  // a name can hold blanks and brackets
  if (name_end == std::string::npos) return 0;
  std::istringstream rest(stat_line.substr(name_end + 1));
  std::string state;
  int parent = 0, group = 0, session = 0, terminal = 0;
  if (!(rest >> state >> parent >> group >> session >> terminal)) return 0;
  const auto number = static_cast<unsigned>(terminal);
  return number == 0 ? 0 : makedev((number >> 8U) & 0xFFFU, (number & 0xFFU) | ((number >> 12U) & 0xFFF00U));
}

// Whether the process sees another set of ptys. One that may not be looked at counts as seeing the same.
bool HasOtherPtys(const fs::path& process, dev_t terminal, dev_t file_system) {
  if (file_system == 0) return false;
  struct stat status {};
  const fs::path node = process / "root/dev/pts" / std::to_string(minor(terminal));
  return stat(node.c_str(), &status) == 0 && status.st_dev != file_system;
}

}  // namespace

std::string SessionOn(dev_t terminal, dev_t file_system) {
  std::error_code error;
  for (fs::directory_iterator process("/proc", error), end; !error && process != end; process.increment(error)) {
    const std::string id = process->path().filename().string();
    if (!IsProcess(id)) continue;
    std::string line;
    std::getline(std::ifstream(process->path() / "stat"), line);
    if (ControllingTerminal(line) != terminal || HasOtherPtys(process->path(), terminal, file_system)) continue;
    const std::size_t begin = line.find('(') + 1;
    return line.substr(begin, line.rfind(')') - begin) + ", process " + id;
  }
  return "";
}

}  // namespace axlecast
