import axlecast.position_t;
import java.io.IOException;
import java.util.HashMap;
import java.util.Locale;
import java.util.Map;
import lcm.lcm.LCM;
import lcm.lcm.LCMDataInputStream;
import lcm.lcm.LCMSubscriber;

/**
 * Prints the positions of one machine's axes: PrintPosition [URL [PREFIX]]
 *
 * <p>It needs lcm.jar of liblcm-java and lcmtypes_axlecast.jar. LCM in Java does not show the numbers of the senders: what was lost is
 * counted by seq of each channel.
 */
public class PrintPosition implements LCMSubscriber {
  private static final String DEFAULT_URL = "udpm://239.255.76.67:7667?ttl=0";
  private static final long MAX_AGE_US = 500_000;

  /** The start of a driver, and the next message that is expected of it. */
  private static class Next {
    long bootId;
    long seq;
  }

  private final String prefix;
  private final Map<String, Next> axes = new HashMap<>();
  private long lost;

  PrintPosition(String prefix) {
    this.prefix = prefix;
  }

  public static void main(String[] arguments) throws IOException, InterruptedException {
    LCM lcm = new LCM(arguments.length > 0 ? arguments[0] : DEFAULT_URL);
    lcm.subscribe(".*POSITION/.*", new PrintPosition(arguments.length > 1 ? arguments[1] : ""));
    Thread.currentThread().join(); // A thread of LCM calls messageReceived, and does not keep the program running.
  }

  @Override
  public void messageReceived(LCM lcm, String channel, LCMDataInputStream data) {
    if (!channel.startsWith(prefix + "POSITION/")) return;
    try {
      print(channel.substring(prefix.length()), new position_t(data));
    } catch (IOException error) {
      System.err.println(channel + ": no position_t: " + error.getMessage());
    }
  }

  private void print(String channel, position_t position) {
    countLost(channel, position);
    System.out.println(channel + " " + text(position) + " " + lost + " lost");
  }

  /** A driver that was restarted has another boot_id, and counts from 0 again. A message that comes late stays lost. */
  private void countLost(String channel, position_t position) {
    Next next = axes.computeIfAbsent(channel, unknown -> new Next());
    if (next.bootId == position.boot_id) {
      if (position.seq < next.seq) return;
      lost += position.seq - next.seq;
    }
    next.bootId = position.boot_id;
    next.seq = position.seq + 1;
  }

  /** The clocks of this host and of the driver's host must agree better than MAX_AGE_US. */
  private static String text(position_t position) {
    if ((position.flags & position_t.FLAG_VALID) == 0) return "not valid";
    if (Math.abs(System.currentTimeMillis() * 1_000 - position.utime) > MAX_AGE_US) return "too old";
    return String.format(Locale.ROOT, "%.3f", position.value);
  }
}
