// In place of uPlot where a build has none: the page then shows no curves, and says how to add them.
export default null;
