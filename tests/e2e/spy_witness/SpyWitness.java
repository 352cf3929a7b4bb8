import java.awt.Component;
import java.awt.Container;
import java.awt.EventQueue;
import java.awt.Frame;
import java.awt.Rectangle;
import java.awt.event.MouseEvent;
import java.lang.reflect.Field;
import java.lang.reflect.InvocationTargetException;
import java.lang.reflect.Modifier;
import javax.swing.JTable;

// Sits in lcm-spy's own process (java.lang.instrument). It double-clicks a channel in lcm-spy's table as a person does, and
// prints what the viewer that opens then shows: one line for each object, "SHOWN <row's type> <class> <field>=<value> ...".
public final class SpyWitness {
    private static Object last;
    private static int looks;  // since the last click

    public static void premain(String channel) {
        Thread thread = new Thread(() -> {
            try {
                while (true) {
                    try {
                        EventQueue.invokeAndWait(() -> look(channel));
                    } catch (InvocationTargetException race) {
                        // lcm-spy's receiving thread changes its table while it is read here.
                        System.out.println("WITNESS LOOKS AGAIN " + race.getCause());
                    }
                    Thread.sleep(20);
                }
            } catch (Exception problem) {
                System.out.println("WITNESS FAILED " + problem);
            }
        });
        thread.setDaemon(true);
        thread.start();
    }

    private static void look(String channel) {
        String type = "";
        for (Frame frame : Frame.getFrames()) {
            JTable table = (JTable) find(frame, JTable.class.getName());
            for (int row = 0; table != null && row < table.getRowCount(); ++row) {
                if (!channel.equals(String.valueOf(table.getValueAt(row, 0)))) continue;
                type = String.valueOf(table.getValueAt(row, 1));
                // A table that is not laid out yet misses a click.
                if (last == null && ++looks % 25 == 0) doubleClick(table, table.getCellRect(row, 0, false));
            }
        }
        for (Frame frame : Frame.getFrames()) {
            Component panel = find(frame, "lcm.spy.ObjectPanel");
            Object shown = panel == null || !panel.isShowing() ? null : fieldOf(panel, "o");
            if (shown != null && shown != last) System.out.println("SHOWN " + type + ' ' + describe(shown));
            if (shown != null) last = shown;
        }
    }

    private static void doubleClick(JTable table, Rectangle cell) {
        table.dispatchEvent(new MouseEvent(table, MouseEvent.MOUSE_CLICKED, System.currentTimeMillis(), 0, cell.x + 2,
                                           cell.y + 2, 2, false, MouseEvent.BUTTON1));
    }

    private static Component find(Container container, String className) {
        for (Component component : container.getComponents()) {
            if (component.getClass().getName().equals(className)) return component;
            Component inside = component instanceof Container ? find((Container) component, className) : null;
            if (inside != null) return inside;
        }
        return null;
    }

    private static Object fieldOf(Object object, String name) {
        try {
            Field field = object.getClass().getDeclaredField(name);
            field.setAccessible(true);
            return field.get(object);
        } catch (ReflectiveOperationException problem) {
            throw new IllegalStateException(problem);
        }
    }

    private static String describe(Object message) {
        StringBuilder text = new StringBuilder(message.getClass().getName());
        for (Field field : message.getClass().getFields()) {
            if (Modifier.isStatic(field.getModifiers())) continue;
            text.append(' ').append(field.getName()).append('=').append(fieldOf(message, field.getName()));
        }
        return text.toString();
    }
}
