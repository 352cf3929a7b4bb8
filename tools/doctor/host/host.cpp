#include "tools/doctor/host/host.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <grp.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <netinet/in.h>
#include <pwd.h>
#include <sys/ioctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <sys/wait.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <system_error>

#include "platform/os/descriptor.h"
#include "platform/os/folder.h"
#include "platform/os/new_file.h"

namespace axlecast {
namespace {

constexpr std::size_t kMaxText = 64 << 10;
constexpr std::size_t kMaxOutput = 4 << 20;  // of a program
constexpr int kNotFound = 127;               // exit code of sh(1)

HostFile::Kind KindOf(mode_t mode) {
  if (S_ISREG(mode)) return HostFile::Kind::kRegular;
  if (S_ISDIR(mode)) return HostFile::Kind::kFolder;
  return S_ISCHR(mode) ? HostFile::Kind::kCharacter : HostFile::Kind::kOther;
}

template <typename Number>
std::optional<Number> ToNumber(std::string_view text) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

bool Holds(const std::string& place, pid_t id, dev_t device) {
  std::error_code error;
  for (const auto& entry :
       std::filesystem::directory_iterator(place + "/proc/" + std::to_string(id) + "/fd", error)) {
    struct stat status {};
    if (stat(entry.path().c_str(), &status) == 0 && S_ISCHR(status.st_mode) && status.st_rdev == device)
      return true;
  }
  return false;
}

// proc(5): "3: FLOCK  ADVISORY  WRITE 1234 00:06:1234 0 EOF"; a process that waits for a lock has "->" after the number.
std::vector<pid_t> Lockers(const std::string& locks, const struct stat& file) {
  std::array<char, 64> file_id{};
  std::snprintf(file_id.data(), file_id.size(), "%02x:%02x:%lu", major(file.st_dev), minor(file.st_dev),
                file.st_ino);
  std::vector<pid_t> ids;
  std::istringstream lines(locks);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string number, kind, how, access, id, inode;
    words >> number >> kind >> how >> access >> id >> inode;
    if (inode != file_id.data() || kind == "->") continue;
    if (const auto process = ToNumber<pid_t>(id); process && *process > 0) ids.push_back(*process);
  }
  return ids;
}

std::string Reason() { return std::strerror(errno); }

// Requests the outgoing interface for an address (rtnetlink(7)).
struct RouteRequest {
  nlmsghdr header{};
  rtmsg route{};
  rtattr destination_header{};
  in_addr destination{};
};
static_assert(sizeof(RouteRequest) == 16 + 12 + 4 + 4, "the layout of netlink");

using RouteReply = std::array<std::uint8_t, 4096>;

template <typename T>
T ReadAt(const RouteReply& reply, std::size_t at) {
  T value{};
  if (at + sizeof value <= reply.size()) std::memcpy(&value, reply.data() + at, sizeof value);
  return value;
}

// Returns the index of the interface in the reply; 0 without an interface. Sets `error` if the kernel refused.
int InterfaceIndex(const RouteReply& reply, std::size_t size, int& error) {
  const auto header = ReadAt<nlmsghdr>(reply, 0);
  if (header.nlmsg_type == NLMSG_ERROR) {
    error = -ReadAt<nlmsgerr>(reply, sizeof header).error;
    return 0;
  }
  if (header.nlmsg_type != RTM_NEWROUTE) return 0;
  std::size_t at = sizeof(nlmsghdr) + sizeof(rtmsg);
  while (at + sizeof(rtattr) <= size) {
    const auto attribute = ReadAt<rtattr>(reply, at);
    if (attribute.rta_len < sizeof attribute) return 0;
    if (attribute.rta_type == RTA_OIF) return ReadAt<int>(reply, at + sizeof attribute);
    at += (attribute.rta_len + std::size_t{3}) & ~std::size_t{3};
  }
  return 0;
}

}  // namespace

HostFile HostFiles::Look(const std::string& path) const {
  HostFile file;
  file.path = path;
  const std::string place = Place(path);
  struct stat status {};
  if (stat(place.c_str(), &status) != 0) {
    file.error = errno;
    return file;
  }
  file.kind = KindOf(status.st_mode);
  file.mode = status.st_mode & 07777;
  file.uid = status.st_uid;
  file.gid = status.st_gid;
  const passwd* const owner = getpwuid(status.st_uid);
  file.owner = owner == nullptr ? std::to_string(status.st_uid) : owner->pw_name;
  const ::group* const group = getgrgid(status.st_gid);
  file.group = group == nullptr ? std::to_string(status.st_gid) : group->gr_name;
  if (file.kind == HostFile::Kind::kCharacter) {
    file.major = major(status.st_rdev);
    file.minor = minor(status.st_rdev);
  }
  file.readable = faccessat(AT_FDCWD, place.c_str(), R_OK, AT_EACCESS) == 0;
  file.writable = faccessat(AT_FDCWD, place.c_str(), W_OK, AT_EACCESS) == 0;
  return file;
}

std::optional<std::string> HostFiles::Text(const std::string& path) const {
  std::ifstream file(Place(path));
  std::string text(kMaxText, '\0');
  file.read(text.data(), kMaxText);
  if (!file.is_open() || file.bad()) return std::nullopt;
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (text.ends_with('\n')) text.pop_back();
  return text;
}

std::optional<std::int64_t> HostFiles::Number(const std::string& path) const {
  const std::optional<std::string> text = Text(path);
  return text ? ToNumber<std::int64_t>(*text) : std::nullopt;
}

std::vector<std::string> HostFiles::Names(const std::string& folder) const {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(Place(folder), error)) {
    names.push_back(entry.path().filename().string());
  }
  std::ranges::sort(names);
  return names;
}

HostProcess HostFiles::Process(pid_t id) const {
  const std::string folder = "/proc/" + std::to_string(id);
  HostProcess process{.id = id, .name = Text(folder + "/comm").value_or(""), .words = {}};
  std::istringstream words(Text(folder + "/cmdline").value_or(""));
  for (std::string word; std::getline(words, word, '\0');) process.words.push_back(word);
  return process;
}

std::vector<pid_t> HostFiles::ProcessIds() const {
  std::vector<pid_t> ids;
  for (const std::string& name : Names("/proc")) {
    if (const auto id = ToNumber<pid_t>(name); id && *id != getpid()) ids.push_back(*id);
  }
  return ids;
}

std::vector<HostProcess> HostFiles::Processes() const {
  std::vector<HostProcess> processes;
  for (const pid_t id : ProcessIds()) processes.push_back(Process(id));
  return processes;
}

std::vector<HostProcess> HostFiles::Holders(const std::string& device) const {
  struct stat status {};
  if (stat(Place(device).c_str(), &status) != 0 || !S_ISCHR(status.st_mode)) return {};
  const std::vector<pid_t> lockers = Lockers(Text("/proc/locks").value_or(""), status);
  std::vector<HostProcess> holders;
  for (const pid_t id : ProcessIds()) {
    const bool locks = std::ranges::find(lockers, id) != lockers.end();
    if (locks || Holds(root_, id, status.st_rdev)) holders.push_back(Process(id));
  }
  return holders;
}

Result<std::string> RunProgram(const std::string& line) {
  FILE* const pipe =
      popen(("{ PATH=$PATH:/usr/sbin:/sbin:/usr/bin:/bin; " + line + "; } </dev/null 2>&1").c_str(), "re");
  if (pipe == nullptr) return Failure(Reason());
  std::string output;
  std::array<char, 4096> buffer{};
  for (std::size_t size = 0; (size = std::fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) {
    if (output.size() < kMaxOutput) output.append(buffer.data(), size);
  }
  const int status = pclose(pipe);
  if (status == 0) return output;
  const std::string program = line.substr(0, line.find(' '));
  if (WIFEXITED(status) && WEXITSTATUS(status) == kNotFound) return Failure(program + " is not installed");
  while (output.ends_with('\n')) output.pop_back();
  return Failure(program + (output.empty() ? " failed" : ": " + output));
}

Result<> WriteValue(const std::string& path, const std::string& value) {
  const Descriptor file(open(path.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC | O_NOCTTY));
  const std::string line = value + '\n';
  if (file.valid() && write(file.get(), line.data(), line.size()) == static_cast<ssize_t>(line.size())) return {};
  return Failure(path + ": " + Reason());
}

Result<> AppendLine(const std::string& path, const std::string& line) {
  std::string text;
  if (std::ifstream file(path); file) text.assign(std::istreambuf_iterator<char>(file), {});
  std::istringstream lines(text);
  for (std::string found; std::getline(lines, found);) {
    if (found == line) return {};
  }
  if (!text.empty() && !text.ends_with('\n')) text += '\n';
  if (Result<> made = MakeFolders(std::filesystem::path(path).parent_path().string(), 0777); !made) return made;
  return WriteNewFile(path, text + line + '\n', {.mode = 0644}, true);
}

MulticastRoute FindMulticastRoute(const std::string& group) {
  MulticastRoute route;
  const Descriptor netlink(socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE));
  RouteRequest request;
  request.header.nlmsg_len = sizeof request;
  request.header.nlmsg_type = RTM_GETROUTE;
  request.header.nlmsg_flags = NLM_F_REQUEST;
  request.route.rtm_family = AF_INET;
  request.route.rtm_dst_len = 32;
  request.destination_header = {sizeof(rtattr) + sizeof(in_addr), RTA_DST};
  inet_pton(AF_INET, group.c_str(), &request.destination);
  RouteReply reply{};
  // The kernel answers before the send returns.
  if (send(netlink.get(), &request, sizeof request, 0) < 0) return route;
  const ssize_t size = recv(netlink.get(), reply.data(), reply.size(), MSG_DONTWAIT);
  if (size < 0) return route;
  const int index = InterfaceIndex(reply, static_cast<std::size_t>(size), route.error);
  std::array<char, IF_NAMESIZE> name{};
  if (if_indextoname(static_cast<unsigned>(index), name.data()) != nullptr) route.interface = name.data();
  return route;
}

LoopbackState ReadLoopback() {
  const Descriptor any(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  ifreq request{};
  std::strncpy(request.ifr_name, "lo", sizeof request.ifr_name - 1);
  if (ioctl(any.get(), SIOCGIFFLAGS, &request) != 0) return {};
  const auto flags = static_cast<unsigned>(request.ifr_flags);
  return {.known = true, .up = (flags & IFF_UP) != 0, .multicast = (flags & IFF_MULTICAST) != 0};
}

RealtimeLimits ReadRealtimeLimits() {
  if (geteuid() == 0) return {.priority = 99, .locked_bytes = -1};
  rlimit priority{};
  rlimit locked{};
  if (getrlimit(RLIMIT_RTPRIO, &priority) != 0 || getrlimit(RLIMIT_MEMLOCK, &locked) != 0) return {};
  return {.priority = static_cast<std::int64_t>(std::min<rlim_t>(priority.rlim_cur, 99)),
          .locked_bytes = locked.rlim_cur == RLIM_INFINITY ? -1 : static_cast<std::int64_t>(locked.rlim_cur)};
}

}  // namespace axlecast
