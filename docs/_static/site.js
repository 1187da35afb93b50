/* what scrolls sideways can be reached and scrolled by the keyboard */
addEventListener("load", () => {
  for (const part of document.querySelectorAll("pre, .cell_output, .table-wrapper, mjx-container")) {
    if (part.scrollWidth > part.clientWidth) part.tabIndex = 0;
  }
});
